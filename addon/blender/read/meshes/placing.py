"""Meshes placed in the world, for all their instances at once."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ....core.parallel import ordered_map, slices
from ..transforms import moved, normal_matrices, turned, unit, within_reach
from .meshes import LocalMesh

MIN_HEIGHT = 1e-7
"""A triangle lower than this share of its longest edge is dropped: in float32 it has no area of its own."""

CHUNK = 1 << 14
"""Rows that a thread works on at a time: their temporary arrays fit its cache."""


@dataclass(frozen=True)
class Model:
    """A mesh and its materials, which instances have in common that differ only in where they stand; t triangles.

    Attributes
    ----------
    mesh : LocalMesh
    material : (t,) int32
    uvs : (t, 3, 2) float32 or None
        Texture coordinates that each triangle's material reads; None where none reads any.
    tangents : (t, 3, 3, 3) float32 or None
        What each triangle's material needs of `ShadingFrames.corner_tangents`, in the mesh's space; None where none
        needs any.
    """

    mesh: LocalMesh
    material: np.ndarray
    uvs: np.ndarray | None
    tangents: np.ndarray | None = None


class Models:
    """The arrays of m models, end to end; `n_vertices`, `n_triangles` and `n_normals` are each model's, (m,) int64."""

    def __init__(self, models: list[Model]) -> None:
        meshes = [model.mesh for model in models]
        self.n_vertices = np.array([len(mesh.vertices) for mesh in meshes])
        self.n_triangles = np.array([len(mesh.triangles) for mesh in meshes])
        self.n_normals = np.array([len(mesh.normals) for mesh in meshes])
        self.vertices = _join([mesh.vertices for mesh in meshes])
        self.triangles = _join([mesh.triangles for mesh in meshes])
        self.normals = _join([mesh.normals for mesh in meshes])
        self.normal_of_corner = _join([mesh.normal_of_corner for mesh in meshes])
        self.material = _join([model.material for model in models])
        self.uvs = _join_if_any([model.uvs for model in models], self.n_triangles, (3, 2))
        self.tangents = _join_if_any([model.tangents for model in models], self.n_triangles, (3, 3, 3))


def _join_if_any(parts: list[np.ndarray | None], lengths: np.ndarray, shape: tuple[int, ...]) -> np.ndarray | None:
    """Arrays one after the other, with zeros for those that are None; None where all are."""
    if all(part is None for part in parts):
        return None
    found = zip(parts, lengths, strict=True)
    return _join([np.zeros((n, *shape), np.float32) if part is None else part for part, n in found])


def _join(parts: list[np.ndarray]) -> np.ndarray:
    """Arrays one after the other; one alone is not copied."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


class _Copies:
    """Rows of k copies of blocks of rows, one after the other.

    Parameters
    ----------
    n_rows : (m,) int64
        Of each block; the blocks lie end to end.
    block : (k,) int64
        What is copied.

    Attributes
    ----------
    first : (k,) int32
        Row that each copy starts at.
    n : int
        Rows of all copies.
    """

    def __init__(self, n_rows: np.ndarray, block: np.ndarray) -> None:
        self._end = np.cumsum(n_rows[block])
        self.first = (self._end - n_rows[block]).astype(np.int32)
        self.n = int(self._end[-1])
        self._shift = (np.cumsum(n_rows) - n_rows)[block] - self.first

    def rows(self, chunk: slice) -> tuple[np.ndarray, np.ndarray]:
        """The copy that each row of a chunk belongs to, and the row that it copies, (r,) int64 each.

        Where all belong to one copy it is said once, (1,), since most rows are large meshes'.
        """
        low, high = np.searchsorted(self._end, [chunk.start, chunk.stop - 1], side="right")
        rows = np.arange(chunk.start, chunk.stop)
        copies = np.arange(low, high + 1)
        if len(copies) == 1:
            return copies, rows + self._shift[copies]
        lengths = np.minimum(self._end[copies], chunk.stop) - np.maximum(self.first[copies], chunk.start)
        return np.repeat(copies, lengths), rows + np.repeat(self._shift[copies], lengths)


class _Batch:
    """Copies of models that are placed together: k copies, each of them an object of its own.

    Attributes
    ----------
    unit_normals : (n, 3) float32
        The copies' normals in the world; NaN where one has no direction.
    lost_names : set of str
        Of copies of which a vertex has no place, as far as `positions` were asked for.
    """

    def __init__(self, models: Models, of_copy: np.ndarray, matrices: np.ndarray, names: list[str]) -> None:
        self.models = models
        self.matrices = matrices.astype(np.float64)
        self.names = names
        self.lost_names: set[str] = set()
        self.vertices = _Copies(models.n_vertices, of_copy)
        self.normals = _Copies(models.n_normals, of_copy)
        self.triangles = _Copies(models.n_triangles, of_copy)
        self.mirrored = np.linalg.det(self.matrices[:, :3, :3]) < 0
        self.unit_normals = np.empty((self.normals.n, 3), np.float32)
        self._normal_matrices = normal_matrices(self.matrices)
        self._normal_lengths = np.empty(self.normals.n if models.tangents is not None else 0, np.float32)
        _in_chunks(self.normals.n, self._place_normals)

    def _place_normals(self, chunk: slice) -> None:
        copy, row = self.normals.rows(chunk)
        normals = turned(self.models.normals.take(row, 0), self._normal_matrices, copy)
        self.unit_normals[chunk] = unit(normals)
        if self.models.tangents is not None:
            self._normal_lengths[chunk] = np.linalg.norm(normals, axis=0)

    def tangents(self, copy: np.ndarray, row: np.ndarray, normal_of_corner: np.ndarray) -> np.ndarray:
        """Tangents of triangles of copies beside normals of length 1 in the world, (r, 3, 3, 3) float32."""
        assert self.models.tangents is not None
        matrices = self._normal_matrices[np.broadcast_to(copy, row.shape)]
        tangents = np.einsum("rij,rckj->rcki", matrices, self.models.tangents.take(row, 0))
        lengths = np.maximum(self._normal_lengths.take(normal_of_corner), 1e-30)
        return (tangents / lengths[..., None, None]).astype(np.float32)

    def positions(self, chunk: slice) -> np.ndarray:
        """Vertices in the world, (r, 3) float32; NaN where one is not finite or too far out."""
        copy, row = self.vertices.rows(chunk)
        positions = moved(self.models.vertices.take(row, 0), self.matrices, copy)
        lost = ~within_reach(positions)
        if lost.any():
            positions[lost] = np.nan
            self.lost_names.update(self.names[at] for at in np.unique(np.broadcast_to(copy, len(lost))[lost]))
        return positions


class PlacedMeshes:
    """Triangles in the world, filled in from the front; room for v vertices and t triangles.

    Rows that nothing is written to take no memory.

    Attributes
    ----------
    vertices : (v, 3) float32, m
    triangles : (t, 3) int32
        Wound so that the geometric normal points where Blender shows the face's front.
    corner_normals : (t, 3, 3) float32
        Of unit length.
    corner_uvs : (t, 3, 2) float32
    corner_tangents : (t, 3, 3, 3) float32 or None
        As `ShadingFrames` has them; None while no mesh needs any.
    material_of_triangle, object_of_triangle : (t,) int32
    lost_names : list of str
        Of objects that have vertices which are not finite or too far out; triangles there have no area.
    whole : (t,) bool
        Which of the triangles have an area.
    first_vertex : (o,) int32
        Of each object.
    n_vertices : int
        That are filled in.
    """

    def __init__(self, n_vertices: int, n_triangles: int) -> None:
        self.vertices = np.empty((n_vertices, 3), np.float32)
        self.triangles = np.empty((n_triangles, 3), np.int32)
        self.corner_normals = np.empty((n_triangles, 3, 3), np.float32)
        self.corner_uvs = np.zeros((n_triangles, 3, 2), np.float32)
        self.corner_tangents: np.ndarray | None = None
        self.material_of_triangle = np.empty(n_triangles, np.int32)
        self.object_of_triangle = np.empty(n_triangles, np.int32)
        self.lost_names: list[str] = []
        self.whole = np.empty(n_triangles, bool)
        self.first_vertex = np.zeros(0, np.int32)
        self.n_vertices = self._n_triangles = 0

    def add(self, models: Models, of_copy: np.ndarray, matrices: np.ndarray, names: list[str]) -> None:
        """Place k copies of models, each as an object of its own.

        Parameters
        ----------
        models : Models
        of_copy : (k,) int64
            The model that each is a copy of.
        matrices : (k, 4, 4) float32
            Local to world.
        names : list of str
            Of the k objects, for messages.
        """
        batch = _Batch(models, of_copy, matrices, names)
        first_object = len(self.first_vertex)
        self.first_vertex = np.append(self.first_vertex, batch.vertices.first + np.int32(self.n_vertices))
        if models.tangents is not None and self.corner_tangents is None:
            self.corner_tangents = np.zeros((len(self.triangles), 3, 3, 3), np.float32)
        _in_chunks(batch.vertices.n, lambda chunk: self._add_vertices(batch, chunk))
        _in_chunks(batch.triangles.n, lambda chunk: self._add_triangles(batch, first_object, chunk))
        self.lost_names += sorted(batch.lost_names)
        self.n_vertices += batch.vertices.n
        self._n_triangles += batch.triangles.n

    def _add_vertices(self, batch: _Batch, chunk: slice) -> None:
        self.vertices[_after(self.n_vertices, chunk)] = batch.positions(chunk)

    def _add_triangles(self, batch: _Batch, first_object: int, chunk: slice) -> None:
        models, into = batch.models, _after(self._n_triangles, chunk)
        copy, row = batch.triangles.rows(chunk)
        of_object, mirrored = first_object + copy, np.broadcast_to(batch.mirrored[copy], row.shape)
        triangles = _rewound(models.triangles.take(row, 0), mirrored)
        triangles += self.first_vertex.take(of_object)[:, None]
        normal_of_corner = _rewound(models.normal_of_corner.take(row, 0), mirrored)
        normal_of_corner += batch.normals.first.take(copy)[:, None]
        normals = batch.unit_normals.take(normal_of_corner, 0)
        geometric, self.whole[into] = _geometric_normals(self.vertices, triangles)
        lost = np.isnan(normals[..., 0])
        if lost.any():
            normals = np.where(lost[..., None], geometric[:, None], normals)
        self.triangles[into], self.corner_normals[into] = triangles, normals
        self.material_of_triangle[into] = models.material.take(row)
        self.object_of_triangle[into] = of_object
        if models.uvs is not None:
            self.corner_uvs[into] = _rewound(models.uvs.take(row, 0), mirrored)
        if models.tangents is not None and self.corner_tangents is not None:
            tangents = batch.tangents(copy, row, _rewound(normal_of_corner, mirrored))
            self.corner_tangents[into] = _rewound(tangents, mirrored)

    def drop_degenerate(self) -> np.ndarray:
        """Drop the triangles without an area, the objects that have no others, and the room that was not needed.

        Returns
        -------
        (o,) bool
            Which objects are left.
        """
        n = self._n_triangles
        self.vertices = self.vertices[: self.n_vertices]
        of_triangles = [name for name in _OF_TRIANGLES if getattr(self, name) is not None]
        for name in of_triangles:
            setattr(self, name, getattr(self, name)[:n])
        whole = self.whole[:n]
        if self.lost_names:  # none of the triangles that are left has these vertices: they go where another one is
            some = self.vertices[self.triangles[np.argmax(whole), 0]] if whole.any() else np.float32(0)
            self.vertices = np.where(np.isnan(self.vertices[:, :1]), some, self.vertices)
        if whole.all():
            return np.ones(len(self.first_vertex), bool)
        left = np.bincount(self.object_of_triangle[whole], minlength=len(self.first_vertex)) > 0
        for name in of_triangles:
            setattr(self, name, getattr(self, name)[whole])
        n_vertices = np.diff(np.append(self.first_vertex, self.n_vertices))
        self.vertices = self.vertices[np.repeat(left, n_vertices)]
        dropped = np.cumsum(np.where(left, 0, n_vertices))
        self.triangles -= dropped[self.object_of_triangle][:, None].astype(np.int32)
        self.object_of_triangle = (np.cumsum(left, dtype=np.int32) - 1)[self.object_of_triangle]
        return left


_OF_CORNERS = ("triangles", "corner_normals", "corner_uvs", "corner_tangents")
_OF_TRIANGLES = (*_OF_CORNERS, "material_of_triangle", "object_of_triangle")


def _after(n: int, chunk: slice) -> slice:
    return slice(n + chunk.start, n + chunk.stop)


def _rewound(rows: np.ndarray, mirrored: np.ndarray) -> np.ndarray:
    """What triangles have at their three corners (r, 3, …), with the corners of mirrored ones in reverse.

    A mirroring turns the winding round, but not the side that Blender shows as the front.
    """
    if mirrored.any():
        rows[mirrored] = rows[mirrored, ::-1]
    return rows


def _in_chunks(n: int, work: Callable[[slice], None]) -> None:
    """Do ``work(chunk)`` for all chunks of n rows, on every core."""
    if n <= CHUNK:
        return work(slice(0, n))
    for _ in ordered_map(work, slices(n, CHUNK)):
        pass


def _geometric_normals(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals (t, 3) by winding, and whether each triangle has an area (t,)."""
    a, b, c = np.ascontiguousarray(vertices.take(triangles.T, axis=0).transpose(0, 2, 1), np.float64)
    ab, ac, bc = b - a, c - a, c - b
    after, before = [1, 2, 0], [2, 0, 1]
    cross = ab[after] * ac[before] - ab[before] * ac[after]
    doubled_area = np.sqrt(np.einsum("in,in->n", cross, cross))
    longest = np.maximum.reduce([np.einsum("in,in->n", edge, edge) for edge in (ab, ac, bc)])
    # The second test is for edges so short that their squares vanish in float32.
    whole = (doubled_area > MIN_HEIGHT * longest) & (longest > 1e-36)
    return (cross / np.where(whole, doubled_area, np.inf)).T, whole
