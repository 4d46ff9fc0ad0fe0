"""Modifiers for odd scenes, some with what they need, some without."""

from contextlib import suppress

import bpy

MODIFIERS = (
    *("ARRAY", "BEVEL", "BOOLEAN", "BUILD", "DECIMATE", "EDGE_SPLIT", "MASK", "MIRROR", "MULTIRES", "REMESH"),
    *("SCREW", "SKIN", "SOLIDIFY", "SUBSURF", "TRIANGULATE", "WELD", "WIREFRAME", "MESH_TO_VOLUME", "VOLUME_TO_MESH"),
    *("ARMATURE", "CAST", "CURVE", "DISPLACE", "HOOK", "LAPLACIANDEFORM", "LATTICE", "MESH_DEFORM", "SHRINKWRAP"),
    *("SIMPLE_DEFORM", "SMOOTH", "CORRECTIVE_SMOOTH", "SURFACE_DEFORM", "WARP", "WAVE", "CLOTH", "COLLISION"),
    *("EXPLODE", "OCEAN", "PARTICLE_INSTANCE", "PARTICLE_SYSTEM", "SOFT_BODY", "DYNAMIC_PAINT", "FLUID"),
    *("DATA_TRANSFER", "MESH_CACHE", "MESH_SEQUENCE_CACHE", "NORMAL_EDIT", "WEIGHTED_NORMAL", "UV_PROJECT"),
    *("UV_WARP", "VERTEX_WEIGHT_EDIT"),
    *("NODES nothing", "NODES pass", "NODES move", "NODES instead", "NODES instances", "NODES curve", "NODES empty"),
)
SETTINGS = {
    "BEVEL": {"segments": 2},
    "BUILD": {"frame_start": -50},
    "DECIMATE": {"ratio": 0.5},
    "MASK": {"invert_vertex_group": True},
    "MIRROR": {"use_bisect_axis": (True, False, False)},
    "REMESH": {"mode": "BLOCKS", "octree_depth": 3},
    "SCREW": {"steps": 4, "render_steps": 6},
    "SUBSURF": {"levels": 1, "render_levels": 2},
    "SIMPLE_DEFORM": {"angle": 1.0},
    "OCEAN": {"resolution": 2, "viewport_resolution": 2},
    "MESH_TO_VOLUME": {"voxel_amount": 8},
    "MESH_CACHE": {"filepath": "//nowhere/missing.mdd"},
}
OF_ANOTHER = {
    **dict.fromkeys(("BOOLEAN", "DATA_TRANSFER", "LATTICE", "CURVE", "PARTICLE_INSTANCE", "VOLUME_TO_MESH"), "object"),
    **dict.fromkeys(("SHRINKWRAP", "SURFACE_DEFORM", "NORMAL_EDIT"), "target"),
    "MESH_DEFORM": "object",
    "MIRROR": "mirror_object",
    "HOOK": "object",
    "ARRAY": "start_cap",
}
"""Which property names another object; Blender takes only what is of the right type."""


def add_modifier(obj, modifier, other):
    """Add a modifier to an object; some refer to another one, which may be of the wrong type, or the same."""
    kind, _, group = modifier.kind.partition(" ")
    added = obj.modifiers.new(modifier.kind, kind)
    if added is None:  # one that a mesh may have but once
        return
    added.show_viewport, added.show_render = modifier.shown != "renders", modifier.shown != "viewport"
    for name, value in SETTINGS.get(kind, {}).items():
        setattr(added, name, value)
    if kind in OF_ANOTHER and other != obj:
        with suppress(TypeError):
            setattr(added, OF_ANOTHER[kind], other)
    if kind == "NODES" and group != "nothing":
        added.node_group = node_group(group)
    if kind == "PARTICLE_SYSTEM":
        scatter(obj.particle_systems[-1].settings, other)


def scatter(particles, other):
    """Five particles that are another object, or hair."""
    particles.count, particles.frame_end, particles.display_percentage = 5, 1, 40
    particles.render_type, particles.instance_object = "OBJECT", other
    if other.name < "n":
        particles.type, particles.render_type = "HAIR", "PATH"


def node_group(kind):
    """A small group of geometry nodes."""
    tree = bpy.data.node_groups.new(kind, "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    given, result = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    if kind == "empty":
        return tree
    end = given.outputs[0]
    if kind == "move":
        move = tree.nodes.new("GeometryNodeSetPosition")
        move.inputs["Offset"].default_value = (0, 0, 0.5)
        tree.links.new(end, move.inputs["Geometry"])
        end = move.outputs["Geometry"]
    elif kind == "instead":
        end = tree.nodes.new("GeometryNodeMeshCube").outputs["Mesh"]
    elif kind == "curve":
        end = tree.nodes.new("GeometryNodeCurvePrimitiveCircle").outputs["Curve"]
    elif kind == "instances":
        on_points, cube = tree.nodes.new("GeometryNodeInstanceOnPoints"), tree.nodes.new("GeometryNodeMeshCube")
        tree.links.new(end, on_points.inputs["Points"])
        tree.links.new(cube.outputs["Mesh"], on_points.inputs["Instance"])
        end = on_points.outputs["Instances"]
    tree.links.new(end, result.inputs[0])
    return tree
