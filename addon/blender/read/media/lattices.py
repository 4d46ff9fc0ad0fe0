"""Values of sockets in the cells of a lattice over a mesh, which Cycles evaluates as it does inside of it.

In each cell there is a triangle that would emit them as light, which is baked at its corners.
"""

from math import ceil

import bpy
import numpy as np

from ...temporary import Temporary
from ..content_key import scene_key, tree_key
from ..materials.cycles_bake import bake_at_corners, path_of, sees_object
from ..materials.nodes import Place
from ..recent import Recent

N_CELLS = 64
"""Along the longest side of a mesh."""

_POINTS = np.array([(1, 0, -1), (-1, 1, 0), (0, -1, 1)]) / 3
"""Of a triangle in a cell, from its middle; their mean is that of what is linear in it."""

CACHE_BYTES = 64 * 2**20
"""What is kept of earlier bakes."""

_baked = Recent(CACHE_BYTES, lambda values: sum(value.nbytes for value in values.values()))


def cells_over(
    mesh: "bpy.types.Mesh", matrix: np.ndarray, shape: tuple[int, ...] | None = None
) -> tuple[tuple[int, int, int], np.ndarray, np.ndarray]:
    """Cells over all of a mesh: as many as asked for, or about as long along each axis in the world.

    Returns
    -------
    shape : (int, int, int)
    low : (3,) float64
        Their least corner, in the mesh's own frame.
    size : (3,) float64
        Of one of them there.
    """
    corners = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", corners)
    low, high = (getattr(corners.reshape(-1, 3), side)(axis=0).astype(np.float64) for side in ("min", "max"))
    extent = np.maximum(high - low, 1e-6 * max((high - low).max(), 1e-6))
    lengths = extent * np.linalg.norm(matrix[:3, :3], axis=0)
    n = shape or [max(ceil(N_CELLS * length / max(lengths.max(), 1e-30) - 1e-6), 1) for length in lengths]
    return (n[0], n[1], n[2]), low, extent / n


def values_in_cells(
    material: "bpy.types.Material",
    places: list[Place],
    obj: "bpy.types.Object",
    mesh: "bpy.types.Mesh",
    matrix: np.ndarray,
) -> dict[Place, np.ndarray]:
    """The mean values of sockets in `cells_over` a mesh, (n, 1 or 3) float32, in C order.

    Parameters
    ----------
    material : bpy.types.Material
        Original.
    places : list of Place
    obj : bpy.types.Object
        Original, whose mesh it is.
    mesh : bpy.types.Mesh
        Evaluated.
    matrix : (4, 4) float64
        Local to world.

    Raises
    ------
    CyclesError
    """
    shape, low, size = cells_over(mesh, matrix)
    names = tuple(path_of(place) for place in places)
    where = (obj.name_full, matrix.tobytes()) if sees_object(material.node_tree) else ()
    space = (tuple(mesh.texspace_location), tuple(mesh.texspace_size), shape, low.tobytes(), size.tobytes())
    key = (tree_key(material.node_tree), scene_key(material, bpy.context.scene), names, where, space)

    def bake() -> dict[int, np.ndarray]:
        middles = (np.indices(shape).reshape(3, -1).T + 0.5)[:, None]
        with Temporary() as temporary:
            corners = temporary.add(_mesh_of(low + (middles + _POINTS) * size))
            corners.use_auto_texspace = False
            corners.texspace_location, corners.texspace_size = mesh.texspace_location, mesh.texspace_size
            found = bake_at_corners(material, places, corners, obj, matrix)
        return {i: found[place].reshape(-1, 3, found[place].shape[1]).mean(axis=1) for i, place in enumerate(places)}

    found = _baked.found(key, bake)
    return {place: found[i] for i, place in enumerate(places)}


def _mesh_of(corners: np.ndarray) -> "bpy.types.Mesh":
    """A mesh of triangles by their corners (n, 3, 3)."""
    n = len(corners)
    mesh = bpy.data.meshes.new("Photon Bake")
    mesh.vertices.add(3 * n)
    mesh.loops.add(3 * n)
    mesh.polygons.add(n)
    mesh.vertices.foreach_set("co", corners.astype(np.float32).ravel())
    mesh.loops.foreach_set("vertex_index", np.arange(3 * n, dtype=np.int32))
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * n, 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    return mesh
