"""Bake targets as `ReceiverMesh`: the original mesh's topology, where modifiers put it in the world.

Light is stored on the original mesh, so each of its vertices must be found again in the evaluated mesh:

- Modifiers that keep the number of vertices (armatures, shape keys, displacement, …): one to one.
- `FIRST_VERTICES`: the result starts with the original vertices, and the light is the light at their evaluated
  positions. That each does so was found by experiment and is held by tests/host/test_receiver_mesh_modifiers.py.
- Any other modifier that changes the number of vertices is refused with a `BakeError`.

Values go on corners where the evaluated mesh has flat faces or sharp edges, and on vertices where it is smooth all
over. Subdivided surfaces take them on vertices: what was an original corner is rounded there.
"""

from collections.abc import Callable

import bpy
import numpy as np

from ..errors import BakeError
from ..progress import Progress
from ..receivers import ReceiverMesh
from .color_attribute import check_editable
from .meshes import attribute, evaluated_mesh
from .transforms import place_normals, to_world

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


def receiver_meshes(
    objects: "list[bpy.types.Object]", depsgraph: "bpy.types.Depsgraph", progress: Progress | None = None
) -> list[ReceiverMesh]:
    """The meshes that values are wanted for.

    Parameters
    ----------
    objects : list of bpy.types.Object
        Original mesh objects of the depsgraph's view layer.
    depsgraph : bpy.types.Depsgraph

    Raises
    ------
    BakeError
        If one of them cannot be baked to, naming it and what to do.
    """
    meshes = []
    for obj in objects:
        if progress is not None:
            progress.check()
        meshes.append(receiver_mesh(obj, depsgraph))
    return meshes


def receiver_mesh(obj: "bpy.types.Object", depsgraph: "bpy.types.Depsgraph") -> ReceiverMesh:
    """The mesh of one object; see `receiver_meshes`."""
    check_target(obj, depsgraph)
    mesh, evaluated_object = obj.data, obj.evaluated_get(depsgraph)
    evaluated, matrix = evaluated_mesh(evaluated_object, depsgraph), np.array(evaluated_object.matrix_world, np.float64)
    local = _positions(evaluated)[: len(mesh.vertices)]
    normals, on_corners = _normals(obj, evaluated, local)
    face_sizes = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_total", face_sizes)
    return ReceiverMesh(
        object_name=obj.name,
        mesh_name=mesh.name,
        domain="CORNER" if on_corners else "POINT",
        positions=to_world(local, matrix, obj.name),
        normals=place_normals(normals, matrix),
        corner_vertex=_corner_vertex(mesh),
        corner_face=np.repeat(np.arange(len(face_sizes), dtype=np.int32), face_sizes),
    )


def check_target(obj: "bpy.types.Object", depsgraph: "bpy.types.Depsgraph") -> None:
    """Make sure that light can be baked to an object's vertices.

    Raises
    ------
    BakeError
        If not, naming the object and what to do.
    """
    check_is_mesh(obj)
    check_editable(obj)
    check_shape(obj, depsgraph)
    _check_modifiers(obj, depsgraph)


def check_is_mesh(obj: "bpy.types.Object") -> None:
    """Make sure that an object is a mesh.

    Raises
    ------
    BakeError
        If not, naming the object and what to do.
    """
    if obj.type != "MESH":
        raise BakeError(f"Object '{obj.name}' is not a mesh: convert it to one (Object > Convert) to bake to it.")


def check_shape(obj: "bpy.types.Object", depsgraph: "bpy.types.Depsgraph") -> None:
    """Make sure that a mesh object has surfaces that are there.

    Raises
    ------
    BakeError
        If not, naming the object and what to do.
    """
    if not len(obj.data.polygons):
        raise BakeError(f"Object '{obj.name}' has no faces to bake to: give it some, or leave it out.")
    evaluated = obj.evaluated_get(depsgraph)
    matrix = np.array(evaluated.matrix_world, np.float64)
    to_world(_positions(evaluated_mesh(evaluated, depsgraph)), matrix, obj.name)
    linear = matrix[:3, :3]
    if abs(np.linalg.det(linear)) <= 1e-9 * np.linalg.norm(linear, axis=0).prod():
        raise BakeError(f"Object '{obj.name}' has zero scale along an axis: give it a scale (N panel > Item > Scale).")


def _positions(mesh: "bpy.types.Mesh") -> np.ndarray:
    """Of the vertices in local space, (v, 3) float32, m."""
    return attribute(mesh, "position", "vector", (len(mesh.vertices), 3), np.float32)


def _check_modifiers(obj: "bpy.types.Object", depsgraph: "bpy.types.Depsgraph") -> None:
    """Make sure that the original vertices can be found in the evaluated mesh."""
    evaluated = evaluated_mesh(obj.evaluated_get(depsgraph), depsgraph)
    n, n_evaluated = len(obj.data.vertices), len(evaluated.vertices)
    # As many vertices in the same faces are the same vertices; as many in others may have been sorted anew.
    if n_evaluated == n and np.array_equal(_corner_vertex(evaluated), _corner_vertex(obj.data)):
        return
    shown = "show_viewport" if depsgraph.mode == "VIEWPORT" else "show_render"
    modifiers = [modifier for modifier in obj.modifiers if getattr(modifier, shown)]
    culprits = [modifier for modifier in modifiers if not _keeps_vertices_first(modifier)]
    if not culprits and n_evaluated >= n:
        return
    name = culprits[0].name if culprits else (modifiers[0].name if modifiers else "?")
    raise BakeError(
        f"Object '{obj.name}': its modifier '{name}' changes the vertices, so light has no vertex of the mesh to go "
        "to: apply the modifier, or disable it."
    )


def _keeps_vertices_first(modifier: "bpy.types.Modifier") -> bool:
    if modifier.type in SAME_VERTICES:
        return True
    if modifier.type == "NODES":
        return modifier.node_group is None or _nodes_keep_vertices(modifier.node_group)
    return modifier.type in FIRST_VERTICES and FIRST_VERTICES[modifier.type](modifier)


def _nodes_keep_vertices(tree: "bpy.types.NodeTree") -> bool:
    """Whether every node that gives out a geometry is one of `SAME_VERTICES_NODES`."""
    for node in tree.nodes:
        if not any(socket.type == "GEOMETRY" for socket in node.outputs) or node.bl_idname in SAME_VERTICES_NODES:
            continue
        if node.type != "GROUP" or (node.node_tree is not None and not _nodes_keep_vertices(node.node_tree)):
            return False
    return True


def _normals(obj: "bpy.types.Object", evaluated: "bpy.types.Mesh", positions: np.ndarray) -> tuple[np.ndarray, bool]:
    """Shading normals in local space, and whether they are corners' (c, 3) or vertices' (v, 3)."""
    mesh = obj.data
    corner_vertex = _corner_vertex(mesh)
    n = len(corner_vertex)
    if _corners_come_first(mesh, evaluated, corner_vertex):
        # A modifier may have made edges sharp ('Smooth by Angle') or smooth: what is seen counts.
        if evaluated.normals_domain == "POINT":
            return _read_normals(evaluated.vertex_normals)[: len(mesh.vertices)], False
        return _read_normals(evaluated.corner_normals)[:n], True
    subdivided = len(evaluated.vertices) != len(mesh.vertices)
    if subdivided or mesh.normals_domain == "POINT":
        return _read_normals(evaluated.vertex_normals)[: len(mesh.vertices)], False
    return _original_corner_normals(obj, positions), True


def _corners_come_first(mesh: "bpy.types.Mesh", evaluated: "bpy.types.Mesh", corner_vertex: np.ndarray) -> bool:
    """Whether an evaluated mesh's corners start with the original ones."""
    n = len(corner_vertex)
    if len(evaluated.loops) < n:
        return False
    # Split edges give corners new vertices, but leave the corners where they were.
    if len(evaluated.loops) == n and len(evaluated.polygons) == len(mesh.polygons):
        return True
    return np.array_equal(_corner_vertex(evaluated)[:n], corner_vertex)


def _original_corner_normals(obj: "bpy.types.Object", positions: np.ndarray) -> np.ndarray:
    """Corner normals (c, 3) of the original topology with its vertices at (v, 3) positions in local space.

    For modifiers that keep the vertices but cut the faces, as Triangulate does.
    """
    copy = obj.to_mesh()  # of an original object: without modifiers, and in no file
    try:
        copy.vertices.foreach_set("co", positions.ravel())
        copy.update()
        return _read_normals(copy.corner_normals)
    finally:
        obj.to_mesh_clear()


def _read_normals(values: "bpy.types.bpy_prop_collection") -> np.ndarray:
    normals = np.empty((len(values), 3), np.float32)
    values.foreach_get("vector", normals.reshape(-1))
    return normals


def _corner_vertex(mesh: "bpy.types.Mesh") -> np.ndarray:
    """The vertex at each corner, (c,) int32."""
    return attribute(mesh, ".corner_vert", "value", (len(mesh.loops),), np.int32)  # `loops` are slow to read
