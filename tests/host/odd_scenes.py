"""Odd scenes, drawn at random: shapes, modifier stacks, modes, shared meshes, missing files, materials, lamps, sets."""

from contextlib import suppress
from dataclasses import dataclass

import bpy  # isort: skip  (the module brings bmesh)
import bmesh
import numpy as np
from hypothesis import strategies as st
from photon_bake.tests.host import scenes
from photon_bake.tests.host.odd_modifiers import MODIFIERS, add_modifier

CUBE = ([(x, y, z) for z in (-1, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))], scenes.CUBE_FACES)
SQUARE = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
CIRCLE = [(np.cos(a), np.sin(a), 0) for a in np.linspace(0, 2 * np.pi, 20, endpoint=False)]
STAR = [(p * np.cos(a), p * np.sin(a), 0.2 * p) for p, a in zip([1, 0.3] * 5, np.arange(10) * np.pi / 5, strict=True)]
SHAPES = {
    "cube": CUBE,
    "square": (SQUARE, [(0, 1, 2, 3)]),
    "room": ([(3 * x, 3 * y, 3 * z) for x, y, z in CUBE[0]], [face[::-1] for face in CUBE[1]]),
    "n-gon": (CIRCLE, [tuple(range(20))]),
    "concave": (STAR, [tuple(range(10))]),
    "doubled faces": (SQUARE, [(0, 1, 2, 3), (3, 2, 1, 0), (0, 1, 2)]),
    "no vertices": ([], []),
    "one vertex": ([(0, 0, 0)], []),
    "loose edges": (SQUARE, []),
    "faces without area": ([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 0, 0)], [(0, 1, 2), (0, 3, 1)]),
    "sliver": ([(0, 0, 0), (1, 0, 0), (0.5, 1e-7, 0), (0.5, -1e-5, 0)], [(0, 1, 2), (0, 3, 1)]),
    "point and square": ([*SQUARE, (0, 0, 0), (0, 0, 0), (0, 0, 0)], [(0, 1, 2, 3), (4, 5, 6)]),
    "1e20": ([*SQUARE[:3], (1e20, 1e20, 0)], [(0, 1, 2, 3)]),
    "inf": (SQUARE, [(0, 1, 2, 3)]),
    "nan": (SQUARE, [(0, 1, 2, 3)]),
}
SHADERS = (
    *("Principled", "Diffuse", "Glossy", "Glass", "Refraction", "Translucent", "Transparent", "Emission", "Sheen"),
    *("Mix", "Add", "Image", "Missing image", "Missing frames", "Missing tiles", "No image"),
    *("Nothing linked", "No output", "No tree", "Holdout"),
)
MISSING = {"Missing image": "FILE", "Missing frames": "SEQUENCE", "Missing tiles": "TILED"}
PICTURES = {"Image", "No image", *MISSING}


@dataclass(frozen=True)
class Look:
    shader: str
    color: tuple
    roughness: float
    metallic: float
    transmission: float
    alpha: float
    ior: float
    strength: float


@dataclass(frozen=True)
class Thing:
    shape: str
    size: float
    location: tuple
    rotation: tuple
    scale: tuple
    smooth: bool
    uv_map: bool
    modifiers: list
    shares_mesh: int
    mode: str
    in_set: bool
    slots: list
    parent: int
    hidden: str
    attribute: bool


@dataclass(frozen=True)
class Modifier:
    kind: str
    other: int
    shown: str


@dataclass(frozen=True)
class Lamp:
    kind: str
    energy: float
    radius: float
    size: float
    angle: float
    location: tuple
    scale: tuple
    in_set: bool


@dataclass(frozen=True)
class Odd:
    looks: list
    things: list
    lamps: list
    kits: list
    world: str
    text: str
    targets: int
    gather: str
    n_cache_rays: int
    add_direct: bool
    copies: bool
    rigid_bodies: bool


def mostly(usual, *odd):
    """The usual value most of the time, or one of the odd ones."""
    return st.sampled_from([usual] * (3 * len(odd)) + list(odd))


def triples(one):
    return st.tuples(one, one, one)


unit = st.sampled_from([0.0, 0.5, 1.0])
scale = triples(mostly(1.0, 0.0, -1.0, 2.0, 1e-6, 1e6))
location = triples(mostly(0.0, 1.0, -2.5, 0.001, 1e5, -1e5))
looks = st.builds(
    Look,
    shader=st.sampled_from(SHADERS),
    color=triples(unit),
    roughness=unit,
    metallic=unit,
    transmission=unit,
    alpha=mostly(1.0, 0.0, 0.5),
    ior=mostly(1.5, 0.0, 1.0, 0.5, 100.0),
    strength=mostly(1.0, 0.0, -1.0, 1e10),
)
modifiers = st.builds(
    Modifier,
    kind=st.sampled_from(MODIFIERS),
    other=st.integers(0, 3),
    shown=mostly("both", "renders", "viewport"),
)
things = st.builds(
    Thing,
    shape=st.one_of(st.sampled_from(list(SHAPES)[:6]), mostly("room", *SHAPES)),
    size=mostly(1.0, 1e-6, 1e6, 1e-3),
    location=location,
    rotation=mostly((0, 0, 0), (0.3, 0.7, 1.1), (np.pi / 2, 0, 0)),
    scale=scale,
    smooth=st.booleans(),
    uv_map=st.booleans(),
    modifiers=st.one_of(st.just([]), st.lists(modifiers, max_size=3)),
    shares_mesh=mostly(-1, 0, 1),
    mode=mostly("", "", "EDIT", "SCULPT", "WEIGHT_PAINT", "VERTEX_PAINT", "TEXTURE_PAINT"),
    in_set=mostly(False, True),
    slots=st.lists(st.integers(-1, 3), max_size=3),
    parent=mostly(-1, 0, 1, 2),
    hidden=mostly("", "hide_render", "hide_viewport", "visible_diffuse", "visible_shadow", "visible_glossy"),
    attribute=st.booleans(),
)
lamps = st.builds(
    Lamp,
    kind=st.sampled_from(["POINT", "SPOT", "SUN", "SQUARE", "RECTANGLE", "DISK", "ELLIPSE"]),
    energy=mostly(100.0, 0.0, 1e-12, 1e12, -5.0),
    radius=mostly(0.1, 0.0, 1e5),
    size=mostly(1.0, 0.0, 1e-6, 1e4),
    angle=mostly(1.0, 0.0, np.pi),
    location=triples(mostly(0.0, 2.0, 1e5)),
    scale=scale,
    in_set=mostly(False, True),
)
odd_scenes = st.builds(
    Odd,
    looks=st.lists(looks, max_size=3),
    things=st.lists(things, min_size=1, max_size=4),
    lamps=st.lists(lamps, max_size=2),
    kits=st.lists(st.lists(st.integers(0, 3), max_size=2), max_size=2),
    world=mostly("white", "none", "black", "image", "missing image", "nothing linked"),
    text=mostly("", "Text", "Metaball"),
    targets=mostly(0, 1, 3),
    gather=mostly("final", "density"),
    n_cache_rays=st.sampled_from([0, 4]),
    add_direct=st.booleans(),
    copies=mostly(False, True),
    rigid_bodies=mostly(False, True),
)


def add_look(look):
    material = bpy.data.materials.new(look.shader)
    if look.shader == "No tree" and bpy.app.version < (5, 0, 0):
        return material
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    if look.shader in {"No tree", "No output"}:
        return material
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    if look.shader != "Nothing linked":
        tree.links.new(add_shader(tree, look).outputs[0], output.inputs["Surface"])
    return material


def add_shader(tree, look):
    if look.shader in {"Mix", "Add"}:
        node = tree.nodes.new(f"ShaderNode{look.shader}Shader")
        shaders = [socket for socket in node.inputs if socket.type == "SHADER"]
        for socket, name in zip(shaders, ("ShaderNodeBsdfGlass", "ShaderNodeEmission"), strict=True):
            tree.links.new(fill(tree.nodes.new(name), look).outputs[0], socket)
        return node
    if look.shader in {"Emission", "Holdout"}:
        return fill(tree.nodes.new(f"ShaderNode{look.shader}"), look)
    image = look.shader in PICTURES
    node = fill(tree.nodes.new("ShaderNodeBsdfPrincipled" if image else f"ShaderNodeBsdf{look.shader}"), look)
    if image:
        picture = tree.nodes.new("ShaderNodeTexImage")
        picture.image = add_image(look.shader)
        tree.links.new(picture.outputs["Color"], node.inputs["Base Color"])
        tree.links.new(picture.outputs["Alpha"], node.inputs["Alpha"])
    return node


def add_image(kind):
    if kind == "No image":
        return None
    image = bpy.data.images.new("Picture", 4, 2, alpha=True)
    if kind in MISSING:
        image.source, image.filepath = MISSING[kind], "//nowhere/missing.<UDIM>.png"
        image.buffers_free()  # else it keeps the pixels that it was made with
    return image


def fill(node, look):
    """Set the sockets that a node has."""
    values = {"Base Color": (*look.color, 1), "Color": (*look.color, 1), "Emission Color": (*look.color, 1)}
    values |= {"Roughness": look.roughness, "Metallic": look.metallic, "Transmission Weight": look.transmission}
    values |= {"Alpha": look.alpha, "IOR": look.ior, "Strength": look.strength}
    for name, value in values.items():
        if name in node.inputs:
            node.inputs[name].default_value = value
    return node


def add_thing(thing, materials):
    vertices, faces = SHAPES[thing.shape]
    obj = scenes.add_mesh(thing.shape, np.array(vertices).reshape(-1, 3) * thing.size, faces, smooth=thing.smooth)
    if thing.shape in {"inf", "nan"}:
        scenes.spoil(obj, float(thing.shape))
    if thing.uv_map:
        obj.data.uv_layers.new(name="UVMap")
    for slot in thing.slots:
        obj.data.materials.append(materials[slot] if 0 <= slot < len(materials) else None)
    if thing.attribute:
        slots = obj.data.attributes.new("material_index", "INT", "FACE")
        slots.data.foreach_set("value", np.arange(len(faces), dtype=np.int32) - 1)
    if thing.hidden:
        setattr(obj, thing.hidden, thing.hidden.startswith("hide"))
    obj.location, obj.rotation_euler, obj.scale = thing.location, thing.rotation, thing.scale
    return obj


def add_lamp(lamp):
    area = lamp.kind not in {"POINT", "SPOT", "SUN"}
    obj = scenes.add_lamp("AREA" if area else lamp.kind, "Lamp", lamp.location, lamp.scale, energy=lamp.energy)
    if area:
        obj.data.shape, obj.data.size, obj.data.size_y = lamp.kind, lamp.size, lamp.size / 2
        obj.data.spread = lamp.angle
    elif lamp.kind == "SUN":
        obj.data.angle = lamp.angle
    else:
        obj.data.shadow_soft_size = lamp.radius
    if lamp.kind == "SPOT":
        obj.data.spot_size = lamp.angle
    return obj


def add_text(kind):
    """A text or a metaball, which are made into meshes."""
    if kind == "Metaball":
        data = bpy.data.metaballs.new(kind)
        data.elements.new()
    else:
        data = bpy.data.curves.new(kind, "FONT")
        data.body, data.extrude = "Odd", 0.1
    bpy.context.scene.collection.objects.link(bpy.data.objects.new(kind, data))


def add_kits(kits, objects):
    """Collections that are instanced twice each, every one within the next."""
    inner = None
    for members in kits:
        kit = bpy.data.collections.new("Kit")
        for member in {member % len(objects) for member in members}:
            kit.objects.link(objects[member])
        if inner is not None:
            kit.objects.link(add_instance(inner, (0, 0, 3), None))
        for x in (5, -5):
            add_instance(kit, (x, 0, 0), bpy.context.scene.collection)
        inner = kit


def add_instance(kit, where, collection):
    empty = bpy.data.objects.new("Empty", None)
    empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", kit, where
    if collection is not None:
        collection.objects.link(empty)
    return empty


def set_world(kind):
    if kind == "none":
        return
    background = scenes.set_world((0, 0, 0) if kind == "black" else (1, 1, 1))
    tree = background.id_data
    if kind == "nothing linked":
        tree.nodes.remove(background)
    elif "image" in kind:
        node = tree.nodes.new("ShaderNodeTexEnvironment")
        node.image = add_image(kind.capitalize())
        tree.links.new(node.outputs["Color"], background.inputs["Color"])


def build(odd):
    """The odd scene in a new file; returns its mesh objects, in the scene or its background set."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    materials = [add_look(look) for look in odd.looks]
    objects = [add_thing(thing, materials) for thing in odd.things]
    for index, (obj, thing) in enumerate(zip(objects, odd.things, strict=True)):
        if 0 <= thing.parent < index:  # chains, but no rings
            obj.parent = objects[thing.parent]
        if 0 <= thing.shares_mesh < index:
            obj.data = objects[thing.shares_mesh].data
        for modifier in thing.modifiers:
            add_modifier(obj, modifier, objects[modifier.other % len(objects)])
    lamps = [add_lamp(lamp) for lamp in odd.lamps]
    add_kits(odd.kits, objects)
    if odd.text:
        add_text(odd.text)
    set_world(odd.world)
    if odd.rigid_bodies:
        bpy.ops.rigidbody.world_add()
    in_set = [obj for obj, one in zip([*objects, *lamps], [*odd.things, *odd.lamps], strict=True) if one.in_set]
    if in_set:
        move_to_set(in_set)
    for obj, thing in zip(objects, odd.things, strict=True):
        if thing.mode and not thing.in_set:
            enter_mode(obj, thing.mode)
            break
    bpy.context.view_layer.update()
    return objects


def move_to_set(objects):
    """Objects go to a scene that is the background set of the scene."""
    scene = bpy.context.scene
    scene.background_set = bpy.data.scenes.new("Set")
    for obj in objects:
        scene.background_set.collection.objects.link(obj)
        scene.collection.objects.unlink(obj)


def enter_mode(obj, mode):
    """Enter a mode if Blender lets it; in edit mode something is changed that only the mode holds."""
    if not obj.visible_get() or obj.hide_select:
        return
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    with suppress(RuntimeError):
        bpy.ops.object.mode_set(mode=mode)
    if obj.mode == "EDIT":
        edited = bmesh.from_edit_mesh(obj.data)
        for vertex in edited.verts:
            vertex.co.z += 0.25
        bmesh.ops.subdivide_edges(edited, edges=edited.edges[:1], cuts=1)
        bmesh.update_edit_mesh(obj.data)
