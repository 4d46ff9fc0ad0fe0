"""Evaluated meshes as triangles: read once in local space, placed in the world for each instance."""

from dataclasses import dataclass
from functools import cached_property

import bpy
import numpy as np

from ..errors import BakeError

MIN_HEIGHT = 1e-7
"""A triangle lower than this share of its longest edge is dropped: in float32 it has no area of its own."""

FARTHEST = 1e15
"""Coordinates this far out are an error, m: products of them would overflow float32."""


@dataclass(frozen=True)
class LocalMesh:
    """Triangles of one mesh in its local space; v vertices, t triangles.

    Attributes
    ----------
    vertices : (v, 3) float32
        Only those that triangles use.
    triangles : (t, 3) int32
    corners : (t, 3) int32
        The mesh's corner at each triangle corner.
    corner_normals : (t, 3, 3) float32
    material_slot : (t,) int32
    uvs : dict of str to (c, 2) float32
        UV maps of the mesh's c corners, read when first asked for.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    corners: np.ndarray
    corner_normals: np.ndarray
    material_slot: np.ndarray
    uvs: "UVMaps"

    @cached_property
    def used_slots(self) -> np.ndarray:
        """Slots that any triangle uses, ascending."""
        return np.unique(self.material_slot)


class UVMaps:
    """UV maps of an evaluated mesh, read when first asked for. Lives no longer than the dependency graph."""

    def __init__(self, mesh: "bpy.types.Mesh") -> None:
        self._mesh = mesh
        self._read: dict[str, np.ndarray] = {}

    def corners(self, name: str) -> np.ndarray:
        """Texture coordinates of the mesh's corners, (c, 2) float32.

        Parameters
        ----------
        name : str
            Of the UV map; empty for the one that is active for rendering. Zero where there is none, as in Cycles.
        """
        if name not in self._read:
            layers = self._mesh.uv_layers
            layer = layers.get(name) if name else next((one for one in layers if one.active_render), None)
            values = np.zeros(len(self._mesh.loops) * 2, np.float32)
            if layer is not None:
                layer.uv.foreach_get("vector", values)
            self._read[name] = np.nan_to_num(values, posinf=0.0, neginf=0.0).reshape(-1, 2)
        return self._read[name]


def read_mesh(mesh: "bpy.types.Mesh") -> LocalMesh | None:
    """The triangles of an evaluated mesh, or None if it has no faces."""
    mesh.calc_loop_triangles()
    n = len(mesh.loop_triangles)
    if not n:
        return None
    vertices = attribute(mesh, "position", "vector", (len(mesh.vertices), 3), np.float32)
    normals = np.empty((len(mesh.loops), 3), np.float32)
    mesh.corner_normals.foreach_get("vector", normals.ravel())
    triangles, corners = np.empty((2, n, 3), np.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles.ravel())
    mesh.loop_triangles.foreach_get("loops", corners.ravel())
    face = np.empty(n, np.int32)
    mesh.loop_triangle_polygons.foreach_get("value", face)
    slot_of_face = attribute(mesh, "material_index", "value", (len(mesh.polygons),), np.int32)
    vertices, triangles = _used(vertices, triangles)
    return LocalMesh(vertices, triangles, corners, normals[corners], slot_of_face[face], UVMaps(mesh))


def attribute(mesh: "bpy.types.Mesh", name: str, prop: str, shape: tuple[int, ...], dtype: type) -> np.ndarray:
    """Values of a mesh attribute, zero where the mesh does not have it."""
    values: np.ndarray = np.zeros(shape, dtype)
    found = mesh.attributes.get(name)
    if found is not None:
        found.data.foreach_get(prop, values.reshape(-1))
    return values


def _used(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Without the vertices that no triangle uses: they would widen the scene's bounds."""
    used = np.zeros(len(vertices), bool)
    used[triangles.ravel()] = True
    if used.all():
        return vertices, triangles
    renumbered = np.cumsum(used, dtype=np.int32) - 1
    return vertices[used], renumbered[triangles]


@dataclass(frozen=True)
class PlacedMesh:
    """A `LocalMesh` in the world: t triangles that have an area.

    Attributes
    ----------
    vertices : (v, 3) float32, m
    triangles : (t, 3) int32
        Wound so that the geometric normal points where Blender shows the face's front.
    corners : (t, 3) int32
    corner_normals : (t, 3, 3) float32
        Of unit length.
    material_slot : (t,) int32
    """

    vertices: np.ndarray
    triangles: np.ndarray
    corners: np.ndarray
    corner_normals: np.ndarray
    material_slot: np.ndarray


def place(mesh: LocalMesh, matrix: np.ndarray, name: str) -> PlacedMesh:
    """A mesh moved into the world.

    Parameters
    ----------
    mesh : LocalMesh
    matrix : (4, 4) float64
        Local to world.
    name : str
        Of the object, for messages.

    Raises
    ------
    BakeError
        If a coordinate is not finite.
    """
    vertices = to_world(mesh.vertices, matrix, name)
    mirrored = np.linalg.det(matrix[:3, :3]) < 0
    # A mirroring turns the winding round, but not the side that Blender shows as the front.
    order = slice(None, None, -1) if mirrored else slice(None)
    triangles, corners = mesh.triangles[:, order], mesh.corners[:, order]
    geometric, whole = _geometric_normals(vertices, triangles)
    normals = place_normals(mesh.corner_normals[:, order], matrix, geometric[:, None])
    if whole.all():
        return PlacedMesh(vertices, triangles, corners, normals, mesh.material_slot)
    return PlacedMesh(vertices, triangles[whole], corners[whole], normals[whole], mesh.material_slot[whole])


def to_world(vertices: np.ndarray, matrix: np.ndarray, name: str) -> np.ndarray:
    """(v, 3) float32 positions moved by a (4, 4) matrix.

    Raises
    ------
    BakeError
        If one is not finite, or too far out.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        moved = (vertices @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32)
    if not (np.abs(moved) < FARTHEST).all():  # so that it is true of NaN too
        raise BakeError(
            f"Object '{name}' has vertices or a transform that are not finite (or beyond {FARTHEST:g} m): repair "
            "them, or hide it from renders."
        )
    return moved


def place_normals(normals: np.ndarray, matrix: np.ndarray, instead: np.ndarray | None = None) -> np.ndarray:
    """(…, 3) normals moved by a (4, 4) matrix, of unit length, float32.

    Where one has no direction `instead` is taken, and +z without it.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        moved = normals @ normal_matrix(matrix).T.astype(np.float32)
        length = np.linalg.norm(moved, axis=-1, keepdims=True)
    good = np.isfinite(length) & (length > 1e-12)
    fallback = np.array([0, 0, 1], np.float32) if instead is None else instead
    return np.where(good, moved / np.where(good, length, 1), fallback).astype(np.float32)


def normal_matrix(matrix: np.ndarray) -> np.ndarray:
    """The inverse transpose of a (4, 4) matrix's linear part up to a positive factor, (3, 3) float64.

    It is the matrix of cofactors, which exists even where the inverse does not, scaled so that the largest entry is 1.
    """
    after, before = [1, 2, 0], [2, 0, 1]
    linear = matrix[:3, :3]
    a, b = linear[after], linear[before]
    cofactors = a[:, after] * b[:, before] - a[:, before] * b[:, after]
    largest = np.abs(cofactors).max()
    sign = -1.0 if linear[0] @ cofactors[0] < 0 else 1.0  # of the determinant
    return cofactors * (sign / largest if largest > 0 else sign)


def _geometric_normals(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals (t, 3) by winding, and whether each triangle has an area (t,)."""
    a, b, c = (vertices[triangles[:, i]].astype(np.float64) for i in range(3))
    ab, ac, bc = b - a, c - a, c - b
    # Several times as fast as np.cross.
    cross = ab[:, [1, 2, 0]] * ac[:, [2, 0, 1]] - ab[:, [2, 0, 1]] * ac[:, [1, 2, 0]]
    doubled_area = np.sqrt(np.einsum("ij,ij->i", cross, cross))
    longest = np.maximum.reduce([np.einsum("ij,ij->i", edge, edge) for edge in (ab, ac, bc)])
    # The second test is for edges so short that their squares vanish in float32.
    whole = (doubled_area > MIN_HEIGHT * longest) & (longest > 1e-36)
    return cross / np.where(whole, doubled_area, np.inf)[:, None], whole
