"""Small scenes for the host tests, and Cycles to compare with."""

import bpy
import numpy as np
from photon_bake.addon.blender import in_render_graph, read_scene
from photon_bake.addon.scene import Lobe


def add_mesh(name, vertices, faces, material=None, smooth=False):
    """A mesh object in the scene."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, v)) for v in vertices], [], [tuple(map(int, f)) for f in faces])
    if smooth:
        mesh.shade_smooth()
    mesh.update()
    if material is not None:
        mesh.materials.append(material)
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def add_plane(name="Plane", size=2.0, **options):
    """A square in the plane z = 0, facing up, with a UV map."""
    h = size / 2
    obj = add_mesh(name, [(-h, -h, 0), (h, -h, 0), (h, h, 0), (-h, h, 0)], [(0, 1, 2, 3)], **options)
    obj.data.uv_layers.new(name="UVMap").uv.foreach_set("vector", [0, 0, 1, 0, 1, 1, 0, 1])
    return obj


CUBE_FACES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


def add_cube(name="Cube", **options):
    """A cube of side 2 around the origin, facing outward."""
    vertices = [(x, y, z) for z in (-1, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return add_mesh(name, vertices, CUBE_FACES, **options)


def spoil(obj, bad):
    """Set a coordinate of a mesh to a value that is not finite."""
    positions = np.empty(len(obj.data.vertices) * 3, np.float32)
    obj.data.vertices.foreach_get("co", positions)
    positions[4] = bad
    obj.data.vertices.foreach_set("co", positions)
    obj.data.update()


def add_lamp(kind, name="Lamp", location=(0, 0, 2), scale=(1, 1, 1), **settings):
    """A lamp object in the scene that shines down."""
    light = bpy.data.lights.new(name, kind)
    for key, value in settings.items():
        setattr(light, key, value)
    obj = bpy.data.objects.new(name, light)
    obj.location, obj.scale = location, scale
    bpy.context.scene.collection.objects.link(obj)
    return obj


def add_material(name="Material", node="ShaderNodeBsdfPrincipled"):
    """A material with one surface node; returns it and the node."""
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    surface = tree.nodes.new(node)
    if "Specular IOR Level" in surface.inputs:
        surface.inputs["Specular IOR Level"].default_value = 0  # else Cycles takes what it reflects off the base colour
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(surface.outputs[0], output.inputs["Surface"])
    return material, surface


def new_image(pixels, byte=True):
    """An image of (h, w, 4) pixels, packed into the file."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.new("Picture", width, height, alpha=True, float_buffer=not byte)
    image.pixels.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())
    image.update()
    image.pack()
    return image


def add_image_node(material, socket, pixels, byte=True, through_reroute=False):
    """An image of (h, w, 4) pixels linked to a socket; returns the node."""
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image, node.interpolation = new_image(pixels, byte), "Closest"
    end = node.outputs["Color"]
    if through_reroute:
        reroute = tree.nodes.new("NodeReroute")
        tree.links.new(end, reroute.inputs[0])
        end = reroute.outputs[0]
    tree.links.new(end, socket)
    return node


def set_world(color, strength=1.0):
    """A world of one colour; returns its Background node."""
    world = bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    if bpy.app.version < (5, 0, 0):
        world.use_nodes = True
    tree = world.node_tree
    tree.nodes.clear()
    background, output = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(background.outputs[0], output.inputs["Surface"])
    background.inputs["Color"].default_value = (*color, 1)
    background.inputs["Strength"].default_value = strength
    return background


def extracted(warnings=None, **options):
    """The scene as renders show it, as a `Scene`."""
    return in_graph(lambda graph: read_scene(graph, warnings, **options)).scene(bpy.context.scene)


def weight_of(materials, lobe, channel=None):
    """Sums of the constant values of the weights of closures of a kind, times those of a channel, (m, 3)."""
    closures, total = materials.closures, np.zeros((len(materials), 3))
    k = np.flatnonzero(closures.kind == lobe)
    values = closures.weight.value[k] * (getattr(closures, channel).value[k] if channel else 1)
    np.add.at(total, closures.material[k], values)
    return total


def albedo_of(materials):
    """Constant values of the diffuse albedos, (m, 3)."""
    return weight_of(materials, Lobe.DIFFUSE)


def in_graph(work):
    """What `work` makes of the graph that renders see."""
    return in_render_graph(bpy.context.scene, bpy.context.view_layer, work)


def depsgraph():
    """The evaluated dependency graph of the scene as it is now."""
    bpy.context.view_layer.update()
    return bpy.context.evaluated_depsgraph_get()


def cycles_bake(obj, what, samples=64):
    """Cycles' Diffuse bake to the corners of an object, (c, 3) float32.

    Parameters
    ----------
    obj : bpy.types.Object
    what : str
        'DIRECT' for E/π without the base colour, 'COLOR' for the base colour.
    samples : int
    """
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = samples
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.sample_clamp_direct = scene.cycles.sample_clamp_indirect = 0
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    attribute = obj.data.color_attributes.new("Cycles", "FLOAT_COLOR", "CORNER")
    obj.data.color_attributes.active_color = attribute
    bpy.context.view_layer.update()
    for other in list(bpy.context.view_layer.objects):
        other.select_set(other.name == obj.name)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={what}, target="VERTEX_COLORS")
    attribute = obj.data.color_attributes["Cycles"]
    values = np.empty(len(attribute.data) * 4, np.float32)
    attribute.data.foreach_get("color", values)
    return values.reshape(-1, 4)[:, :3]


def cycles_picture(obj, kind, side=64):
    """Cycles' bake of an object with one material and a UV map, such as EMIT, to an image, (side, side, 3) float32."""
    scene, tree = bpy.context.scene, obj.data.materials[0].node_tree
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 4
    target = tree.nodes.new("ShaderNodeTexImage")
    target.image = bpy.data.images.new("Baked", side, side, float_buffer=True)
    tree.nodes.active = target
    bpy.context.view_layer.update()
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.bake(type=kind, target="IMAGE_TEXTURES")
    values = np.empty(side * side * 4, np.float32)
    target.image.pixels.foreach_get(values)
    return values.reshape(side, side, 4)[..., :3]


def light_of(name, attribute="Indirect"):
    """What a bake wrote to an object's vertices or corners, (e, 4) float32; None without it."""
    found = bpy.data.objects[name].data.attributes.get(attribute)
    if found is None:
        return None
    values = np.empty(len(found.data) * 4, np.float32)
    found.data.foreach_get("color", values)
    return values.reshape(-1, 4)
