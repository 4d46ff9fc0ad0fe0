"""What modifiers do to the elements of a mesh, by their types and settings."""

from collections.abc import Callable

import bpy

FIRST_VERTICES: dict[str, Callable[["bpy.types.Modifier"], bool]] = {
    "ARRAY": lambda _: True,
    "EDGE_SPLIT": lambda _: True,
    "MIRROR": lambda modifier: not any(modifier.use_bisect_axis),
    "MULTIRES": lambda _: True,
    "SOLIDIFY": lambda modifier: modifier.solidify_mode == "EXTRUDE",
    "SUBSURF": lambda _: True,
    "WIREFRAME": lambda modifier: not modifier.use_replace,
}
"""Modifiers that put the original vertices first, and with which settings."""

SAME_VERTICES = {
    "ARMATURE",
    "CAST",
    "CLOTH",
    "COLLISION",
    "CORRECTIVE_SMOOTH",
    "CURVE",
    "DATA_TRANSFER",
    "DISPLACE",
    "DYNAMIC_PAINT",
    "HOOK",
    "LAPLACIANDEFORM",
    "LAPLACIANSMOOTH",
    "LATTICE",
    "MESH_CACHE",
    "MESH_DEFORM",
    "MESH_SEQUENCE_CACHE",
    "NORMAL_EDIT",
    "PARTICLE_SYSTEM",
    "SHRINKWRAP",
    "SIMPLE_DEFORM",
    "SMOOTH",
    "SOFT_BODY",
    "SURFACE",
    "SURFACE_DEFORM",
    "TRIANGULATE",
    "UV_PROJECT",
    "UV_WARP",
    "VERTEX_WEIGHT_EDIT",
    "VERTEX_WEIGHT_MIX",
    "VERTEX_WEIGHT_PROXIMITY",
    "WARP",
    "WAVE",
    "WEIGHTED_NORMAL",
}
"""Modifiers that leave the number and order of vertices alone."""

SAME_VERTICES_NODES = {
    "GeometryNodeCaptureAttribute",
    "GeometryNodeReplaceMaterial",
    "GeometryNodeSetMaterial",
    "GeometryNodeSetMaterialIndex",
    "GeometryNodeSetMeshNormal",
    "GeometryNodeSetPosition",
    "GeometryNodeSetShadeSmooth",
    "GeometryNodeStoreNamedAttribute",
    "GeometryNodeRemoveAttribute",
    "NodeGroupInput",
    "NodeGroupOutput",
    "NodeReroute",
}
"""Geometry nodes that do the same; 'Smooth by Angle' is made of them."""


COPIES_FACES = {"ARRAY", "MIRROR", "SOLIDIFY", "WIREFRAME"}
"""Those of `FIRST_VERTICES` that make further faces elsewhere, which show the light of the first ones."""


def active_modifiers(obj: "bpy.types.Object", mode: str) -> "list[bpy.types.Modifier]":
    """The modifiers of an original object that a dependency graph evaluates, by its mode 'VIEWPORT' or 'RENDER'."""
    shown = "show_viewport" if mode == "VIEWPORT" else "show_render"
    return [modifier for modifier in obj.modifiers if getattr(modifier, shown)]


def may_change_elements(obj: "bpy.types.Object") -> bool:
    """Whether a modifier of an original object may leave other vertices first than the mesh's own."""
    return not all(keeps_vertices_first(modifier) for modifier in obj.modifiers)


def can_be_probed(obj: "bpy.types.Object") -> bool:
    """Whether a copy of an original object can be evaluated beside it: two of a fluid's domains crash Blender."""
    return not any(modifier.type == "FLUID" and _is_fluid_domain(modifier) for modifier in obj.modifiers)


def _is_fluid_domain(modifier: "bpy.types.Modifier") -> bool:
    return modifier.fluid_type == "DOMAIN"


def cutters(obj: "bpy.types.Object") -> "list[bpy.types.Object]":
    """Objects whose faces Boolean modifiers hand on to an original object, and whose meshes can hold their light.

    Renders do not show them, as they would have light of their own.
    """
    found = [
        modifier.object
        for modifier in obj.modifiers
        if modifier.type == "BOOLEAN" and modifier.operand_type == "OBJECT" and modifier.object is not None
    ]
    return [one for one in dict.fromkeys(found) if one.type == "MESH" and one != obj and _can_hold_light(one)]


def _can_hold_light(cutter: "bpy.types.Object") -> bool:
    hidden = cutter.hide_render or all(home.hide_render for home in cutter.users_collection)
    hidden = hidden and can_be_probed(cutter)
    return hidden and cutter.library is None and cutter.data.is_editable and len(cutter.data.polygons) > 0


def keeps_vertices_first(modifier: "bpy.types.Modifier") -> bool:
    """Whether the mesh that a modifier makes starts with the vertices that it is given, where they stay in order."""
    if modifier.type in SAME_VERTICES:
        return True
    if modifier.type == "NODES":
        return modifier.node_group is None or _nodes_keep_vertices(modifier.node_group)
    if modifier.type == "FLUID":
        return not _is_fluid_domain(modifier)
    return modifier.type in FIRST_VERTICES and FIRST_VERTICES[modifier.type](modifier)


def _nodes_keep_vertices(tree: "bpy.types.NodeTree") -> bool:
    """Whether every node that gives out a geometry is one of `SAME_VERTICES_NODES`."""
    for node in tree.nodes:
        if not any(socket.type == "GEOMETRY" for socket in node.outputs) or node.bl_idname in SAME_VERTICES_NODES:
            continue
        if node.type != "GROUP" or (node.node_tree is not None and not _nodes_keep_vertices(node.node_tree)):
            return False
    return True
