"""Hair and point clouds, in the way of a lamp."""

import bpy
import numpy as np

from ..registry import case
from ..stage import lamp, matte, mesh, nodes, picture, probes, put, quad, room, shader
from .stage import GROUP, modified, shaded_room


def curves(name, keys, radii, material):
    """A hair curves object of n strands with m keys each, (n, m, 3), and radii that (n, m) takes."""
    keys = np.asarray(keys, np.float32)
    data = bpy.data.hair_curves.new(name)
    data.add_curves([keys.shape[1]] * len(keys))
    data.position_data.foreach_set("vector", keys.ravel())
    values = np.broadcast_to(np.asarray(radii, np.float32), keys.shape[:2]).ravel()
    data.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", values)
    data.materials.append(material)
    return put(name, data)


def lawn(n, half=1.0, low=-2.0, height=0.5, lean=0.3, n_keys=5):
    """Strands that bend over on a grid of n × n, (n², n_keys, 3)."""
    x, y = np.meshgrid(np.linspace(-half, half, n), np.linspace(-half, half, n))
    roots = np.stack([x.ravel(), y.ravel()], axis=1)
    turn = 2 * np.pi * np.random.default_rng(5).random(len(roots))
    t = np.linspace(0, 1, n_keys)
    aside = lean * t**2 * np.stack([np.cos(turn), np.sin(turn)])[..., None]
    up = np.broadcast_to(low + height * t, aside.shape[1:])
    return np.stack([roots[:, :1] + aside[0], roots[:, 1:] + aside[1], up], axis=2)


def under_a_panel(material):
    """A dim room with a floor of the material, and a panel that shines down on it."""
    room(paint={"Floor": material}, dim=0.5)
    probes("Left Right Front Back Ceiling", 32)
    lamp("AREA", (0, 0, 0.5), size=1.0, energy=100)


def grown(obj, count, length, material, **settings):
    """Particle hair on an object."""
    obj.data.materials.append(material)
    modified(obj, "PARTICLE_SYSTEM")
    hair = obj.particle_systems[0].settings
    hair.type, hair.count, hair.hair_length, hair.material = "HAIR", count, length, len(obj.data.materials)
    for key, value in settings.items():
        setattr(hair, key, value)
    return obj


def ball(radius=0.5):
    """A round mesh."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16, radius=radius)
    obj = bpy.context.object
    obj.data.materials.append(matte((0.3, 0.3, 0.3), "Skin"))
    return obj


def made_by_nodes(obj, *steps):
    """An object whose geometry nodes make new geometry: nodes in a row, each with inputs by name and properties."""
    group = bpy.data.node_groups.new("Made", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    last = None
    for kind, into, inputs, properties in steps:
        node = group.nodes.new("GeometryNode" + kind)
        for key, value in properties.items():
            setattr(node, key, value)
        for key, value in inputs.items():
            if isinstance(value, str):
                other = group.nodes.new("GeometryNode" + value)
                group.links.new(other.outputs[0], node.inputs[key])
            else:
                node.inputs[key].default_value = value
        if last is not None:
            group.links.new(last.outputs[0], node.inputs[into])
        last = node
    end = group.nodes.new("NodeGroupOutput")
    group.links.new(last.outputs[0], end.inputs[0])
    return modified(obj, "NODES", node_group=group)


@case("Hair curves, black grass", GROUP)
def hair():
    # Black grass on the floor.
    under_a_panel(matte((0.7, 0.7, 0.7)))
    curves("Lawn", lawn(40, lean=0.0, n_keys=2), 0.01, matte((0, 0, 0), "Black"))


@case("Hair curves, a lawn", GROUP)
def hair_lawn():
    under_a_panel(matte((0.7, 0.7, 0.7)))
    curves("Lawn", lawn(60), 0.012 * np.linspace(1, 0.1, 5), matte((0.2, 0.7, 0.1), "Green"))


@case("Hair curves, thick with tips", GROUP)
def hair_thick():
    # Round curves in place of ribbons.
    bpy.context.scene.cycles_curves.shape = "THICK"
    shaded_room()
    keys = lawn(5, half=0.5, low=-0.5, height=0.6, lean=0.4)
    curves("Spikes", keys, [0.08, 0.08, 0.06, 0.03, 0], matte((0.7, 0.1, 0.05), "Red"))


@case("Hair curves, an object scaled unevenly", GROUP)
def hair_scaled():
    shaded_room()
    keys = lawn(12, half=0.5, low=-0.2, height=0.4)
    obj = curves("Spikes", keys, 0.03, matte((0.7, 0.1, 0.05), "Red"))
    obj.scale, obj.rotation_euler = (2.0, 0.7, 1.0), (0.3, 0, 0.5)


@case("Hair curves without a radius, instanced", GROUP)
def hair_instances():
    shaded_room()
    obj = curves("Tuft", lawn(12, half=0.4, low=-0.1, height=0.3), 0.02, matte((0.7, 0.1, 0.05), "Red"))
    obj.data.attributes.remove(obj.data.attributes["radius"])
    for at in ((0.5, 0.5, 0), (-0.5, 0.5, 0), (0.5, -0.5, 0.1)):
        put("Tuft", obj.data).location = at


@case("Hair curves that geometry nodes make", GROUP)
def hair_nodes():
    shaded_room()
    obj = curves("Made", [[(0, 0, 0), (0, 0, 1)]], 0.02, matte((0.7, 0.1, 0.05), "Red"))
    made_by_nodes(
        obj,
        ("MeshGrid", "", {"Size X": 1.4, "Size Y": 1.4, "Vertices X": 15, "Vertices Y": 15}, {}),
        ("InstanceOnPoints", "Points", {"Instance": "CurvePrimitiveCircle", "Scale": (0.08, 0.08, 1)}, {}),
        ("RealizeInstances", "Geometry", {}, {}),
        ("SetCurveRadius", "Curve", {"Radius": 0.02}, {}),
        ("SetMaterial", "Geometry", {"Material": matte((0.7, 0.1, 0.05), "Red")}, {}),
    )


@case("Particle hair", GROUP)
def particle_hair():
    shaded_room()
    obj = quad("Skin", (0, 0, -0.4), (0.7, 0, 0), (0, 0.7, 0), matte((0.3, 0.3, 0.3), "Skin"))
    shape = {"root_radius": 2.0, "tip_radius": 0.5, "radius_scale": 0.02, "shape": 0.3}
    grown(obj, 500, 0.3, matte((0.7, 0.1, 0.05), "Red"), **shape)


@case("Particle hair, children alone", GROUP)
def particle_children():
    shaded_room()
    obj = quad("Skin", (0, 0, -0.4), (0.7, 0, 0), (0, 0.7, 0), matte((0.3, 0.3, 0.3), "Skin"))
    children = {"child_type": "SIMPLE", "rendered_child_count": 12, "child_percent": 2, "child_radius": 0.1}
    shape = {"radius_scale": 0.02, "use_close_tip": True, "tip_radius": 0.5}
    obj = grown(obj, 60, 0.3, matte((0.7, 0.1, 0.05), "Red"), **children, **shape)
    obj.show_instancer_for_render = False


@case("Particle hair, a ball of fur before a lamp", GROUP)
def fur_ball():
    room(dim=0.6)
    probes()
    children = {"child_type": "INTERPOLATED", "rendered_child_count": 20, "roughness_2": 0.05}
    grown(ball(), 300, 0.25, matte((0.6, 0.35, 0.1), "Fur"), radius_scale=0.012, **children)
    lamp("POINT", (1.2, 0, 0.3), energy=100, shadow_soft_size=0.1)


@case("Particle hair, coloured by the skin's texture", GROUP)
def hair_texture():
    shaded_room()
    tree = nodes("Painted")
    image = picture([[(0.9, 0.05, 0.05), (0.05, 0.05, 0.9)]])
    tree.done(tree.add("BsdfDiffuse", {"Color": tree.add("TexImage", image=image, interpolation="Closest")}))
    obj = quad("Skin", (0, 0, -0.4), (0.7, 0, 0), (0, 0.7, 0), matte((0, 0, 0), "Skin"))
    grown(obj, 600, 0.3, tree.block, radius_scale=0.03, tip_radius=1.0)


@case("Hair with a Principled BSDF", GROUP)
def hair_principled():
    under_a_panel(matte((0.7, 0.7, 0.7)))
    fur = shader("BsdfPrincipled", {"Base Color": (0.7, 0.4, 0.1), "Roughness": 0.4}, "Fur")
    curves("Lawn", lawn(60), 0.012, fur)


@case("Hair with a Principled Hair BSDF", GROUP)
def hair_fibres():
    under_a_panel(matte((0.7, 0.7, 0.7)))
    curves("Lawn", lawn(60), 0.003, shader("BsdfHairPrincipled", {"Color": (0.7, 0.4, 0.1)}, "Fur"))


@case("Hair with a Principled Hair BSDF by melanin, sparse", GROUP)
def hair_melanin():
    under_a_panel(matte((0.7, 0.7, 0.7)))
    brown = {"Melanin": 0.5, "Melanin Redness": 0.5, "Roughness": 0.2, "Radial Roughness": 0.6, "Coat": 0.5}
    curves("Lawn", lawn(30), 0.012, shader("BsdfHairPrincipled", brown, "Fur", parametrization="MELANIN"))


@case("Hair with a Principled Hair BSDF, so dense that strands touch", GROUP, differs="tubes in place of ribbons")
def hair_fibres_dense():
    under_a_panel(matte((0.7, 0.7, 0.7)))
    curves("Lawn", lawn(60), 0.012, shader("BsdfHairPrincipled", {"Color": (0.7, 0.4, 0.1)}, "Fur"))


@case("Hair with a Hair BSDF", GROUP, differs="less light that strands scatter to each other")
def hair_cone():
    under_a_panel(matte((0.7, 0.7, 0.7)))
    curves("Lawn", lawn(30), 0.012, shader("BsdfHair", {"Color": (0.7, 0.4, 0.1)}, "Fur"))


@case("Hair, translucent", GROUP)
def hair_translucent():
    under_a_panel(matte((0.7, 0.7, 0.7)))
    curves("Lawn", lawn(30), 0.012, shader("BsdfTranslucent", {"Color": (0.7, 0.4, 0.1)}, "Grass"))


@case("A point cloud of balls", GROUP)
def points():
    shaded_room()
    obj = mesh("Balls", [(0.4, 0, 0), (-0.3, 0.4, -0.2), (0, -0.5, 0.1), (-0.5, -0.2, 0)], [])
    made_by_nodes(
        obj,
        ("MeshGrid", "", {"Size X": 1.4, "Size Y": 1.4, "Vertices X": 4, "Vertices Y": 4}, {}),
        ("MeshToPoints", "Mesh", {"Radius": 0.15}, {}),
        ("SetMaterial", "Geometry", {"Material": matte((0.7, 0.1, 0.05), "Red")}, {}),
    )


@case("A point cloud of dust", GROUP)
def dust():
    shaded_room()
    obj = put("Dust", bpy.data.meshes.new("Dust"))
    made_by_nodes(
        obj,
        ("MeshGrid", "", {"Size X": 1.8, "Size Y": 1.8, "Vertices X": 150, "Vertices Y": 150}, {}),
        ("MeshToPoints", "Mesh", {"Radius": 0.005}, {}),
        ("SetMaterial", "Geometry", {"Material": matte((0.7, 0.1, 0.05), "Red")}, {}),
    )


@case("Point clouds as instances", GROUP)
def point_instances():
    shaded_room()
    obj = put("Dust", bpy.data.meshes.new("Dust"))
    made_by_nodes(
        obj,
        ("MeshGrid", "", {"Size X": 1.2, "Size Y": 1.2, "Vertices X": 3, "Vertices Y": 3}, {}),
        ("InstanceOnPoints", "Points", {"Instance": "Points", "Scale": (0.5, 1.5, 1)}, {}),
        ("SetMaterial", "Geometry", {"Material": matte((0.7, 0.1, 0.05), "Red")}, {}),
    )


def by_hair_info(combine):
    """A matte material that goes from blue to orange by a number that a function makes of a Hair Info node."""
    tree = nodes("Strands")
    color = tree.add("Mix", data_type="RGBA")
    tree.feed(color.inputs[0], combine(tree, tree.add("HairInfo").outputs))
    tree.feed(color.inputs[6], (0.05, 0.1, 0.6))
    tree.feed(color.inputs[7], (0.9, 0.5, 0.1))
    return tree.done(tree.add("BsdfDiffuse", {"Color": color.outputs[2]}))


@case("Hair coloured along its length (Hair Info)", GROUP)
def hair_info_intercept():
    shaded_room()
    keys = lawn(12, half=0.7, low=-0.4, height=0.5)
    curves("Spikes", keys, 0.03, by_hair_info(lambda tree, info: info["Intercept"]))


@case("Hair of two colours at random (Hair Info)", GROUP)
def hair_info_random():
    def second(tree, info):
        return tree.add("Math", {0: info["Random"], 1: 0.7}, operation="GREATER_THAN")

    shaded_room()
    curves("Spikes", lawn(20, half=0.7, low=-0.4, height=0.5), 0.02, by_hair_info(second))


@case("Hair coloured by its length and thickness (Hair Info)", GROUP)
def hair_info_size():
    def size(tree, info):
        thickness = tree.add("Math", {0: info["Thickness"], 1: 5.0}, operation="MULTIPLY")
        both = tree.add("Math", {0: info["Length"], 1: thickness}, operation="ADD")
        return tree.add("Math", {0: both, 1: info["Is Strand"]}, operation="MULTIPLY")

    shaded_room()
    curves("Spikes", lawn(12, half=0.7, low=-0.4, height=0.5), 0.03, by_hair_info(size))
