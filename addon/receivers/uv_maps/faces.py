"""The faces of a mesh that is to be laid flat."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...core.sampling.vectors import dot


@dataclass(frozen=True)
class Faces:
    """The faces of a mesh: v vertices, c corners, f faces, t triangles.

    Attributes
    ----------
    positions : (v, 3) float32, m
        As large as in the world; turned in any way. All are finite.
    corner_vertex : (c,) int32
    n_corners : (f,) int32
        Of each face; their corners follow each other.
    triangles : (t, 3) int32
        Corners of the triangles that the faces are cut into.
    """

    positions: np.ndarray
    corner_vertex: np.ndarray
    n_corners: np.ndarray
    triangles: np.ndarray

    def __len__(self) -> int:
        return len(self.n_corners)

    @cached_property
    def face_of_corner(self) -> np.ndarray:
        """The face of each corner, (c,) int32."""
        return np.repeat(np.arange(len(self.n_corners), dtype=np.int32), self.n_corners)

    @cached_property
    def following(self) -> np.ndarray:
        """The next corner of each corner's face, (c,) int32."""
        following = np.arange(1, len(self.corner_vertex) + 1, dtype=np.int32)
        ends = np.cumsum(self.n_corners)
        following[ends - 1] = ends - self.n_corners
        return following

    @cached_property
    def face_of_triangle(self) -> np.ndarray:
        """The face of each triangle, (t,) int32."""
        return self.face_of_corner[self.triangles[:, 0]]

    def corners(self) -> np.ndarray:
        """Positions of the triangles' corners, (t, 3, 3) float32, m."""
        return self.positions[self.corner_vertex[self.triangles]]

    @cached_property
    def vector_areas(self) -> np.ndarray:
        """Normals of the faces times their area, (f, 3) float64, m²; 0 for faces without an area."""
        corners = self.corners().astype(np.float64)
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
        return np.stack([np.bincount(self.face_of_triangle, column, len(self)) for column in cross.T], axis=1)

    @cached_property
    def edges(self) -> np.ndarray:
        """For each corner a number of the edge that it begins, (c,) int64; −1 for those without a length.

        Vertices in one place are one.
        """
        vertex = self._joined_vertices()
        a, b = vertex[self.corner_vertex], vertex[self.corner_vertex[self.following]]
        return np.where(a == b, -1, np.minimum(a, b).astype(np.int64) * (len(vertex) + 1) + np.maximum(a, b))

    def border(self, part: np.ndarray) -> np.ndarray:
        """Which corners begin an edge that no other face of their part (f,) shares, (c,) bool; all, where none does."""
        order = np.lexsort([part[self.face_of_corner], self.edges])
        edge, of = self.edges[order], part[self.face_of_corner][order]
        follows = np.append(False, (edge[1:] == edge[:-1]) & (of[1:] == of[:-1]) & (edge[1:] >= 0))
        shared = np.empty(len(order), bool)
        shared[order] = follows | np.append(follows[1:], False)
        of_corner = part[self.face_of_corner]
        return ~shared | (np.bincount(of_corner, ~shared)[of_corner] == 0)

    def neighbours(self) -> tuple[np.ndarray, np.ndarray]:
        """Pairs of faces that share an edge, (p,) int32 each."""
        edge = self.edges
        order = np.argsort(edge, kind="stable")
        same = (edge[order[1:]] == edge[order[:-1]]) & (edge[order[1:]] >= 0)
        first, second = self.face_of_corner[order[:-1][same]], self.face_of_corner[order[1:][same]]
        return first, second

    def _joined_vertices(self) -> np.ndarray:
        """For each vertex a number, the same for those in one place, (v,) int64."""
        x, y, z = (self.positions + np.float32(0)).T.copy().view(np.uint32).astype(np.uint64)
        _, plane = np.unique(x << np.uint64(32) | y, return_inverse=True)
        return np.unique(plane.reshape(-1).astype(np.uint64) << np.uint64(32) | z, return_inverse=True)[1].reshape(-1)

    @property
    def area(self) -> float:
        """Of all triangles, m²."""
        return float(areas(self.corners()).sum())


def areas(corners: np.ndarray) -> np.ndarray:
    """Areas of triangles with corners (t, 3, 2) or (t, 3, 3), (t,) float64."""
    first = (corners[:, 1] - corners[:, 0]).astype(np.float64)
    second = (corners[:, 2] - corners[:, 0]).astype(np.float64)
    if corners.shape[2] == 2:
        return np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2
    cross = np.cross(first, second)
    return np.sqrt(dot(cross, cross)) / 2
