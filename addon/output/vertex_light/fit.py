"""Values of vertices that come nearest to the light over faces: least squares vertex baking.

Between vertices the shown light is linear: x(p) = Σ b_i(p) x_i with the barycentric weights b of p. The values that
come nearest to the light E over all faces minimise

    ∫ (x(p) − E(p))² dA + α Σ_e A_e (h_e j_e)²

(Kavan, Bargteil and Sloan, "Least Squares Vertex Baking", 2011). The integral is a sum over samples. The second term
decides what samples leave open, and takes the zigzag out of it: j_e is the jump of the gradient across the edge e
between two triangles of an area A_e/3 together, and h_e their mean height; light that is linear costs nothing. Values
are held between the least and the most light around a vertex, give or take a quarter of the difference, and are never
negative where light is not: the bounds of a least-squares problem that an active set solves, by conjugate gradients.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...core.progress import Progress
from ...core.sampling.vectors import dot, rows
from ...receivers import FaceSamples, ShownFaces

REGULARIZATION = 0.01
"""α. Where meshes are fine, 0.003 to 0.1 have like errors; on the large faces of cornell 0.1 costs a fifteenth."""

SLACK = 0.25
"""Of the range of light around a vertex, by which its value may leave it: a parabola needs a sixth."""

VERTEX_SHARE = 1 / 12
"""Of a triangle's area, for each of its vertices, if it has one sample, in its middle: exact for parabolas."""

_ROUNDS = 5  # of the active set
_TOLERANCE = 1e-5  # of the right side's length
_MOST_STEPS = 300
_LEAST = 1e-6  # of the diagonal: what nothing is known of stays as it was sampled


@dataclass(frozen=True)
class FaceFit:
    """The least-squares problem of n vertices, s samples and e inner edges.

    Attributes
    ----------
    basis : (s, n) sparse
        Barycentric weights of the samples.
    jump : (e, n) sparse
        Jumps of the gradient times mean heights.
    sample_area : (s,) float64, m²
    vertex_area : (n,) float64, m²
        That vertices stand for as samples themselves.
    edge_area : (e,) float64, m²
    corner : (t, 3) int
        Vertices of the faces.
    face : (s,) int
        Of each sample.
    """

    basis: Any
    jump: Any
    sample_area: np.ndarray
    vertex_area: np.ndarray
    edge_area: np.ndarray
    corner: np.ndarray
    face: np.ndarray

    @staticmethod
    def of(
        faces: ShownFaces, samples: FaceSamples, n: int, vertex_has_say: np.ndarray, sample_has_say: np.ndarray
    ) -> "FaceFit":
        """Of faces between the vertices 0 to n − 1; samples and vertices without a say do not count."""
        from scipy.sparse import csr_array

        number = np.bincount(samples.face, minlength=len(faces))
        of_vertex = faces.area * np.where(number > 0, VERTEX_SHARE / np.maximum(number, 1), 1 / 3)
        of_sample = (faces.area - 3 * of_vertex) / np.maximum(number, 1)
        corner = faces.receiver[samples.face]
        at = np.arange(len(samples)).repeat(3), corner.ravel()
        basis = csr_array((samples.weight.astype(np.float64).ravel(), at), (len(samples), n))
        vertex_area = np.bincount(faces.receiver.ravel(), of_vertex.repeat(3), n) * vertex_has_say
        sample_area = of_sample[samples.face] * sample_has_say
        jump, edge_area = _jumps(faces, n)
        return FaceFit(basis, jump, sample_area, vertex_area, edge_area, faces.receiver, samples.face)

    def values(self, at_vertices: np.ndarray, at_samples: np.ndarray, progress: Progress) -> np.ndarray:
        """The values (n, c) float64 that are nearest to light at the vertices (n, c) and at the samples (s, c)."""
        start = at_vertices.astype(np.float64)
        light = at_samples.astype(np.float64)
        low, high = self._bounds(start, light)
        right = self.basis.T @ (self.sample_area[:, None] * light) + self.vertex_area[:, None] * start
        right += self._hold[:, None] * start
        columns = [
            self._bounded(right[:, i], start[:, i], low[:, i], high[:, i], progress) for i in range(start.shape[1])
        ]
        return np.stack(columns, axis=1)

    def mean(self, at_vertices: np.ndarray, at_samples: np.ndarray) -> np.ndarray:
        """Weighted means (n,) of what vertices are fitted to; of vertices without any, their own."""
        weight = self.basis.T @ self.sample_area + self.vertex_area
        total = self.basis.T @ (self.sample_area * at_samples) + self.vertex_area * at_vertices
        return np.where(weight > 0, total / np.maximum(weight, 1e-30), at_vertices)

    @cached_property
    def _diagonal(self) -> np.ndarray:
        of_samples = self.basis.multiply(self.basis).T @ self.sample_area
        return of_samples + self.vertex_area + REGULARIZATION * (self.jump.multiply(self.jump).T @ self.edge_area)

    @cached_property
    def _hold(self) -> np.ndarray:
        return _LEAST * self._diagonal + 1e-30

    def _bounds(self, at_vertices: np.ndarray, at_samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The least and the most that each vertex may have, (n, c): by what has a say on the faces around it."""
        low, high = (
            _around(self.corner, self.face, self.sample_area > 0, at_samples, self.vertex_area > 0, at_vertices, sign)
            for sign in (-1, 1)
        )
        darkest = np.minimum(at_samples.min(axis=0, initial=0), at_vertices.min(axis=0, initial=0))
        unknown = ~np.isfinite(high)
        low, high = np.where(unknown, at_vertices, low), np.where(unknown, at_vertices, high)
        slack = SLACK * (high - low)
        return np.maximum(low - slack, darkest), high + slack

    def _bounded(
        self, right: np.ndarray, start: np.ndarray, low: np.ndarray, high: np.ndarray, progress: Progress
    ) -> np.ndarray:
        """One column of `values`: those at a bound that the gradient holds them to are fixed, until none changes."""
        diagonal = self._diagonal + self._hold
        value, fixed = np.clip(start, low, high), np.zeros(len(start), bool)
        for _ in range(_ROUNDS):
            found = self._solved(right, value, fixed, diagonal, progress)
            value = np.clip(found, low, high)
            if np.array_equal(value, found):
                break
            slope = self._product(value) - right
            fixed = ((value <= low) & (slope > 0)) | ((value >= high) & (slope < 0))
        return value

    def _solved(
        self, right: np.ndarray, value: np.ndarray, fixed: np.ndarray, diagonal: np.ndarray, progress: Progress
    ) -> np.ndarray:
        """The least-squares values where some are fixed."""
        from scipy.sparse import diags_array
        from scipy.sparse.linalg import LinearOperator, cg

        def product(free: np.ndarray) -> np.ndarray:
            progress.check()
            return np.where(fixed, free, self._product(np.where(fixed, 0, free)))

        n = len(right)
        wanted = np.where(fixed, value, right - self._product(np.where(fixed, value, 0)))
        matrix = LinearOperator((n, n), matvec=product, dtype=np.float64)
        scale = diags_array(1 / np.where(fixed, 1, diagonal))
        return np.asarray(cg(matrix, wanted, x0=value, rtol=_TOLERANCE, maxiter=_MOST_STEPS, M=scale)[0])

    def _product(self, value: np.ndarray) -> np.ndarray:
        """The normal matrix times values (n,)."""
        of_samples = self.basis.T @ (self.sample_area * (self.basis @ value))
        of_edges = self.jump.T @ (self.edge_area * (self.jump @ value))
        return of_samples + REGULARIZATION * of_edges + (self.vertex_area + self._hold) * value


def _around(
    corner: np.ndarray,
    face: np.ndarray,
    sample_counts: np.ndarray,
    at_samples: np.ndarray,
    vertex_counts: np.ndarray,
    at_vertices: np.ndarray,
    sign: int,
) -> np.ndarray:
    """The most (sign 1) or the least (−1) of what counts on the faces around each vertex, (n, c); infinite if none."""
    of_face = np.full((len(corner), at_samples.shape[1]), -np.inf)
    np.maximum.at(of_face, face[sample_counts], sign * at_samples[sample_counts])
    of_vertex = np.where(vertex_counts[:, None], sign * at_vertices, -np.inf)
    for i in range(3):
        of_face = np.maximum(of_face, rows(of_vertex, corner[:, i]))
    most = np.full(at_vertices.shape, -np.inf)
    for i in range(3):
        np.maximum.at(most, corner[:, i], of_face)
    return sign * most


def _jumps(faces: ShownFaces, n: int) -> tuple[Any, np.ndarray]:
    """For edges between two triangles: h·j of vertex values, (e, n) sparse, and areas, (e,).

    A triangle's gradient across an edge is what its tip has more than the foot of its height, over the height h_i. The
    sum over both triangles is j, and h = 2/(1/h_1 + 1/h_2).
    """
    from scipy.sparse import csr_array

    triangle, side = np.arange(len(faces)).repeat(3), np.tile(np.arange(3), len(faces))
    left, right, tip = ((triangle, (side + i) % 3) for i in (1, 2, 0))
    ends = np.sort(np.stack([faces.receiver[left], faces.receiver[right]], axis=1), axis=1).astype(np.int64)
    key = ends[:, 0] * n + ends[:, 1]
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    start = first[np.diff(first, append=len(key)) == 2]
    pairs = order[np.stack([start, start + 1])]  # half edges, (2, e)

    origin = faces.position[left].astype(np.float64)
    edge, way = faces.position[right] - origin, faces.position[tip] - origin
    foot = dot(way, edge) / np.maximum(dot(edge, edge), 1e-30)
    height = np.maximum(np.linalg.norm(way - foot[:, None] * edge, axis=1), 1e-12)
    mean = 2 / (1 / height[pairs]).sum(axis=0)
    weight = mean / height[pairs]
    parts = ((tip, weight), (left, weight * (foot[pairs] - 1)), (right, -weight * foot[pairs]))
    column = np.concatenate([faces.receiver[place][pairs].ravel() for place, _ in parts])
    row = np.tile(np.arange(pairs.shape[1]), len(column) // max(pairs.shape[1], 1))
    jump = csr_array((np.concatenate([value.ravel() for _, value in parts]), (row, column)), (pairs.shape[1], n))
    return jump, faces.area[triangle[pairs]].sum(axis=0) / 3
