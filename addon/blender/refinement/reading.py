"""Meshes that can be refined, as triangles where objects show them."""

import bpy
import numpy as np

from ...core.errors import BakeError
from ...pipeline.refinement import Placed
from ...receivers import ReceiverMesh
from ..read.meshes.modifiers import active_modifiers, keeps_vertices_first
from ..read.meshes.vertex_meshes import check_target

_LETS_THROUGH = {
    *("ARMATURE", "ARRAY", "COLLISION", "CURVE", "EDGE_SPLIT", "LATTICE", "MIRROR", "NORMAL_EDIT", "SOLIDIFY"),
    *("TRIANGULATE", "UV_PROJECT", "UV_WARP", "VERTEX_WEIGHT_EDIT", "VERTEX_WEIGHT_MIX", "VERTEX_WEIGHT_PROXIMITY"),
    "WEIGHTED_NORMAL",
}
"""Modifiers that show further vertices of a mesh where they are put, and that keep nothing by vertices' numbers."""

_SUBDIVIDES = {"MULTIRES", "SUBSURF"}

REFINES_OTHERWISE = "apply the modifier first, or subdivide by hand"


def check_refinable(obj: "bpy.types.Object", depsgraph: "bpy.types.Depsgraph") -> None:
    """Make sure that new vertices of an object's mesh would leave its shape as it is.

    Raises
    ------
    BakeError
        If not, naming the object and what to do.
    """
    check_target(obj, depsgraph)
    if obj.data.is_editmode:
        raise BakeError(f"Object '{obj.name}' is in edit mode: leave it to refine its mesh.")
    for modifier in obj.modifiers:
        if modifier.type in _SUBDIVIDES:
            raise BakeError(
                f"Object '{obj.name}': new vertices would change the shape that its modifier '{modifier.name}' makes: "
                "raise the modifier's levels, or apply it."
            )
        through = modifier.type in _LETS_THROUGH or (modifier.type == "NODES" and keeps_vertices_first(modifier))
        if not through and modifier in active_modifiers(obj, depsgraph.mode):
            raise BakeError(
                f"Object '{obj.name}': its modifier '{modifier.name}' would not take new vertices as they are: "
                f"{REFINES_OTHERWISE}."
            )


def placed(obj: "bpy.types.Object", mesh: ReceiverMesh, widest: int | None = None) -> tuple[Placed, np.ndarray]:
    """The triangles of an object's stored mesh, and their corners in the mesh, (t, 3) int32.

    Parameters
    ----------
    mesh : ReceiverMesh
        What the object shows of it, without a map.
    widest : int, optional
        Read so many triangles alone, those of the largest area; which vertices lie in one place is not told then.
    """
    stored = obj.data
    stored.calc_loop_triangles()
    n = len(stored.loop_triangles)
    loops, polygon = np.empty((n, 3), np.uint32), np.empty(n, np.int32)
    stored.loop_triangles.foreach_get("loops", loops.reshape(-1))
    stored.loop_triangle_polygons.foreach_get("value", polygon)
    loops = loops.view(np.int32)
    a, b, c = (mesh.positions[mesh.corner_vertex[loops[:, k]]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    chosen = np.flatnonzero(np.isfinite(area))  # others have vertices that are nowhere
    if widest is not None and len(chosen) > widest:
        chosen = chosen[np.argpartition(area[chosen], len(chosen) - widest)[-widest:]]
    loops, polygon = loops[chosen], polygon[chosen]
    at = Placed(
        object_name=obj.name,
        mesh_name=stored.name,
        position=mesh.positions,
        corner=mesh.corner_vertex[loops],
        normal=mesh.corner_normals[loops],
        polygon=polygon,
        weld=np.arange(len(stored.vertices), dtype=np.int32) if widest is not None else _welds(stored),
    )
    return at, loops


def _welds(mesh: "bpy.types.Mesh") -> np.ndarray:
    """Numbers of a mesh's vertices, (v,) int32, which are equal for those in one place."""
    local = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", local.reshape(-1))
    order = np.lexsort(local.T)
    apart = (np.diff(local[order], axis=0) != 0).any(axis=1)
    weld = np.empty(len(local), np.int32)
    weld[order] = np.concatenate([[0], np.cumsum(apart)])[: len(local)]
    return weld
