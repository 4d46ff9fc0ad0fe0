"""Triangles that are split at their longest edges, without a vertex in the middle of another's edge."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...receivers import ReceiverMesh

_AFTER = np.array([1, 2, 0])
_CORNERS = np.arange(3)


@dataclass(frozen=True)
class Placed:
    """A stored mesh where an object shows it: v vertices, t triangles.

    Attributes
    ----------
    object_name, mesh_name : str
    position : (v, 3) float32, m
        World space.
    corner : (t, 3) int32
        Vertices of the triangles.
    normal : (t, 3, 3) float32
        Unit shading normals of their corners, world space.
    polygon : (t,) int32
        The face that each is a part of.
    weld : (v,) int32
        Equal for vertices in one place.
    """

    object_name: str
    mesh_name: str
    position: np.ndarray
    corner: np.ndarray
    normal: np.ndarray
    polygon: np.ndarray
    weld: np.ndarray

    @property
    def n_polygons(self) -> int:
        return int(self.polygon.max(initial=-1)) + 1


@dataclass(frozen=True)
class Triangles:
    """t triangles of p points, which stand for v vertices of stored meshes: one point a vertex and object.

    Attributes
    ----------
    point : (t, 3) int32
    normal : (t, 3, 3) float32
        Unit shading normals of the corners.
    owner : (t,) int32
        Which of the `Placed` each belongs to.
    polygon : (t,) int32
        Numbered through all stored meshes.
    position : (p, 3) float32, m
    vertex : (p,) int32
        Numbered through all stored meshes.
    weld : (v,) int32
        Equal for vertices of one stored mesh in one place.
    mesh : (v,) int32
        Which stored mesh each is of, in the order in which the objects name them.
    """

    point: np.ndarray
    normal: np.ndarray
    owner: np.ndarray
    polygon: np.ndarray
    position: np.ndarray
    vertex: np.ndarray
    weld: np.ndarray
    mesh: np.ndarray

    @staticmethod
    def of(meshes: list[Placed]) -> "Triangles":
        """Those of several objects; objects that share a mesh share its vertices and faces."""
        stored = {mesh.mesh_name: mesh for mesh in meshes}
        sizes = [len(mesh.weld) for mesh in stored.values()]
        first_vertex = dict(zip(stored, np.cumsum([0, *sizes]), strict=False))
        first_polygon = dict(zip(stored, np.cumsum([0, *(mesh.n_polygons for mesh in stored.values())]), strict=False))
        start = np.cumsum([0, *(len(mesh.position) for mesh in meshes)])
        vertices = [np.arange(len(mesh.position)) + first_vertex[mesh.mesh_name] for mesh in meshes]
        return Triangles(
            point=np.concatenate([mesh.corner + n for mesh, n in zip(meshes, start, strict=False)]).astype(np.int32),
            normal=np.concatenate([mesh.normal for mesh in meshes]),
            owner=np.repeat(np.arange(len(meshes), dtype=np.int32), [len(mesh.corner) for mesh in meshes]),
            polygon=np.concatenate([mesh.polygon + first_polygon[mesh.mesh_name] for mesh in meshes]).astype(np.int32),
            position=np.concatenate([mesh.position for mesh in meshes]),
            vertex=np.concatenate(vertices).astype(np.int32),
            weld=np.concatenate([mesh.weld + first_vertex[name] for name, mesh in stored.items()]).astype(np.int32),
            mesh=np.repeat(np.arange(len(sizes), dtype=np.int32), sizes),
        )

    def __len__(self) -> int:
        return len(self.point)

    @cached_property
    def area(self) -> np.ndarray:
        """(t,) float32, m²."""
        a, b, c = (self.position[self.point[:, k]] for k in range(3))
        return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2

    @cached_property
    def edges(self) -> "Edges":
        return Edges.of(self)

    def receiver_mesh(self, rows: np.ndarray) -> ReceiverMesh:
        """Some of the triangles as a mesh whose corners want light."""
        face = np.repeat(np.arange(len(rows), dtype=np.int32), 3)
        normal, corner = self.normal[rows].reshape(-1, 3), self.point[rows].ravel()
        return ReceiverMesh("", "", "CORNER", self.position, normal, corner, face)

    def split(self, edges: np.ndarray) -> "Split":
        """Split edges (k,), each of which is the longest of all its triangles, in the middle."""
        row = np.flatnonzero(np.isin(self.edges.longest, edges))
        side = self.edges.longest_side[row]
        a, b, c = (self.point[row, (side + k) % 3] for k in range(3))
        pairs, new_point = _pairs(a, b, len(self.position))
        ends = self.vertex[pairs]
        vertex_pairs, new_vertex = _pairs(*_columns(ends), len(self.weld))
        _, new_weld = _pairs(*_columns(self.weld[vertex_pairs]), int(self.weld.max()) + 1)
        middle = (new_point + len(self.position)).astype(np.int32)
        na, nb, nc = (self.normal[row, (side + k) % 3] for k in range(3))
        nm = na + nb
        nm /= np.maximum(np.linalg.norm(nm, axis=1, keepdims=True), np.float32(1e-30))
        point, normal = self.point.copy(), self.normal.copy()
        point[row], normal[row] = np.stack([a, middle, c], axis=1), np.stack([na, nm, nc], axis=1)
        position = (self.position[pairs[:, 0]] + self.position[pairs[:, 1]]) / 2
        after = Triangles(
            point=np.concatenate([point, np.stack([middle, b, c], axis=1)]),
            normal=np.concatenate([normal, np.stack([nm, nb, nc], axis=1)]),
            owner=np.concatenate([self.owner, self.owner[row]]),
            polygon=np.concatenate([self.polygon, self.polygon[row]]),
            position=np.concatenate([self.position, position]),
            vertex=np.concatenate([self.vertex, (new_vertex + len(self.weld)).astype(np.int32)]),
            weld=np.concatenate([self.weld, (new_weld + int(self.weld.max()) + 1).astype(np.int32)]),
            mesh=np.concatenate([self.mesh, self.mesh[vertex_pairs[:, 0]]]),
        )
        return Split(after, row, side, vertex_pairs)


@dataclass(frozen=True)
class Split:
    """Triangles after k were split: the first halves (a, m, c) in their places, the others (m, b, c) at the end.

    Attributes
    ----------
    after : Triangles
    row : (k,) int
        The triangles that were split.
    side : (k,) int
        Which corner of each was a.
    ends : (m, 2) int32
        Vertices that new ones, which follow the others, lie between.
    """

    after: Triangles
    row: np.ndarray
    side: np.ndarray
    ends: np.ndarray

    def halves(self, of_corner: np.ndarray) -> np.ndarray:
        """Values (t, 3, …) of corners after the split, interpolated in the new ones."""
        a, b, c = (of_corner[self.row, (self.side + k) % 3] for k in range(3))
        m = (a + b) / 2
        values = of_corner.copy()
        values[self.row] = np.stack([a, m, c], axis=1)
        return np.concatenate([values, np.stack([m, b, c], axis=1)])

    def moved(self, triangle: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where points in triangles (s,) of barycentric weights (s, 3) lie after the split: triangle and weights."""
        n = len(self.after) - len(self.row)
        half, first = np.full(n, -1), np.zeros(n, np.int64)
        half[self.row], first[self.row] = np.arange(n, n + len(self.row)), self.side
        at = np.flatnonzero(half[triangle] >= 0)
        turned = (first[triangle[at]][:, None] + _CORNERS) % 3
        a, b, c = np.take_along_axis(weight[at], turned, axis=1).T
        in_first = a >= b
        inside = np.where(in_first, [a - b, 2 * b, c], [2 * a, b - a, c]).T
        triangle, weight = triangle.copy(), weight.copy()
        weight[at] = inside
        triangle[at] = np.where(in_first, triangle[at], half[triangle[at]])
        return triangle, weight


@dataclass(frozen=True)
class Edges:
    """e edges of t triangles; those in one place are one, and so are those of objects that share a mesh.

    Attributes
    ----------
    of_side : (t, 3) int
        Edge between the corners k and k + 1.
    longest : (t,) int
    longest_side : (t,) int
    to : (e,) int
        From each edge over ever longer ones of neighbouring triangles, the one where that ends, which is the longest of
        all its triangles (Rivara's longest-edge propagation path).
    n_vertices : (e,) int
        That are made when it is split.
    """

    of_side: np.ndarray
    longest: np.ndarray
    longest_side: np.ndarray
    to: np.ndarray
    n_vertices: np.ndarray

    @staticmethod
    def of(triangles: Triangles) -> "Edges":
        a, b = triangles.point.ravel(), triangles.point[:, _AFTER].ravel()
        length = np.linalg.norm(triangles.position[a] - triangles.position[b], axis=1)
        va, vb = triangles.vertex[a], triangles.vertex[b]
        vertex_pairs, real = _pairs(va, vb, len(triangles.weld))
        n_welds = int(triangles.weld.max(initial=0)) + 1
        pairs, edge_of_real = _pairs(*_columns(triangles.weld[vertex_pairs]), n_welds)
        edge, n = edge_of_real[real], len(pairs)
        of_edge = np.zeros(n, length.dtype)
        np.maximum.at(of_edge, edge, length)
        order = np.lexsort((np.arange(n), of_edge))
        rank = np.empty(n, np.int64)
        rank[order] = np.arange(n)
        of_side = edge.reshape(-1, 3)
        side = rank[of_side].argmax(axis=1)
        longest = np.take_along_axis(of_side, side[:, None], axis=1)[:, 0]
        best = rank.copy()
        np.maximum.at(best, edge, np.repeat(rank[longest], 3))
        to = order[best]
        while not np.array_equal(to, to[to]):
            to = to[to]
        return Edges(of_side, longest, side, to, np.bincount(edge_of_real, minlength=n))


def _pairs(a: np.ndarray, b: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """The different unordered pairs (m, 2) int32 of numbers below n, and which of them each of (k,) pairs is."""
    key = np.minimum(a, b).astype(np.int64) * n + np.maximum(a, b)
    pairs, of_pair = np.unique(key, return_inverse=True)
    return np.stack(np.divmod(pairs, n), axis=1).astype(np.int32), of_pair.reshape(-1)


def _columns(pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return pairs[:, 0], pairs[:, 1]
