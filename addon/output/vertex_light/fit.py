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
from typing import NamedTuple

import numpy as np

from ...core.compiling import kernel, kernel_array, part
from ...core.progress import Progress
from ...core.sampling.vectors import rows
from ...core.vec3 import add, dot, length, minus, plus, put, row, times
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


class Edges(NamedTuple):
    """Edges between two triangles each.

    Attributes
    ----------
    vertex : (e, 4) int32
        The triangles' tips, and the edge's ends.
    share : (e, 4) float64
        What the values there make of the jump of the gradient times the mean height, h·j.
    area : (e,) float64, m²
    """

    vertex: np.ndarray
    share: np.ndarray
    area: np.ndarray


class _Matrix(NamedTuple):
    """The normal matrix, as kernels multiply by it: that of samples, of edges and of vertices themselves."""

    corner: np.ndarray
    weight: np.ndarray
    sample_area: np.ndarray
    edges: Edges
    of_vertex: np.ndarray


@dataclass(frozen=True)
class FaceFit:
    """The least-squares problem of n vertices, s samples and e inner edges.

    Attributes
    ----------
    corner : (s, 3) int32
        Vertices of each sample's face.
    weight : (s, 3) float64
        Barycentric weights of the samples.
    sample_area : (s,) float64, m²
    vertex_area : (n,) float64, m²
        That vertices stand for as samples themselves.
    edges : Edges
    face_corner : (t, 3) int32
        Vertices of the faces.
    face : (s,) int32
        Of each sample.
    """

    corner: np.ndarray
    weight: np.ndarray
    sample_area: np.ndarray
    vertex_area: np.ndarray
    edges: Edges
    face_corner: np.ndarray
    face: np.ndarray

    @staticmethod
    def of(
        faces: ShownFaces, samples: FaceSamples, n: int, vertex_has_say: np.ndarray, sample_has_say: np.ndarray
    ) -> "FaceFit":
        """Of faces between the vertices 0 to n − 1; samples and vertices without a say do not count."""
        number = np.bincount(samples.face, minlength=len(faces))
        of_vertex = faces.area * np.where(number > 0, VERTEX_SHARE / np.maximum(number, 1), 1 / 3)
        of_sample = (faces.area - 3 * of_vertex) / np.maximum(number, 1)
        face_corner = kernel_array(faces.receiver, np.int32)
        vertex_area = np.bincount(face_corner.ravel(), of_vertex.repeat(3), n) * vertex_has_say
        sample_area = of_sample[samples.face] * sample_has_say
        corner, weight = rows(face_corner, samples.face), samples.weight.astype(np.float64)
        edges, face = inner_edges(faces, n), kernel_array(samples.face, np.int32)
        return FaceFit(corner, weight, sample_area, vertex_area, edges, face_corner, face)

    def at_samples(self, values: np.ndarray) -> np.ndarray:
        """What values of the vertices (n, c) show at the samples, (s, c) float64."""
        return np.einsum("sk,skc->sc", self.weight, rows(values, self.corner))

    def values(self, at_vertices: np.ndarray, at_samples: np.ndarray, progress: Progress) -> np.ndarray:
        """The values (n, 3) float64 that are nearest to light at the vertices (n, 3) and at the samples (s, 3).

        Those at a bound that the gradient holds them to are fixed, until none changes.
        """
        start, light = at_vertices.astype(np.float64), at_samples.astype(np.float64)
        low, high = self._bounds(start, light)
        right = np.stack([self._onto_vertices(self.sample_area * light[:, i]) for i in range(3)], axis=1)
        right += (self.vertex_area + self._hold)[:, None] * start
        value, fixed, product = np.clip(start, low, high), np.zeros(start.shape, bool), np.empty(start.shape)
        for _ in range(_ROUNDS):
            found = self._solved(right, value, fixed, progress)
            value = np.clip(found, low, high)
            if np.array_equal(value, found):
                break
            _multiply(self._matrix, value, product)
            slope = product - right
            fixed = ((value <= low) & (slope > 0)) | ((value >= high) & (slope < 0))
        return value

    def mean(self, at_vertices: np.ndarray, at_samples: np.ndarray) -> np.ndarray:
        """Weighted means (n,) of what vertices are fitted to; of vertices without any, their own."""
        weight = self._onto_vertices(self.sample_area) + self.vertex_area
        total = self._onto_vertices(self.sample_area * at_samples) + self.vertex_area * at_vertices
        return np.where(weight > 0, total / np.maximum(weight, 1e-30), at_vertices)

    def _onto_vertices(self, of_samples: np.ndarray) -> np.ndarray:
        """Sums (n,) of samples' values (s,), each shared out to its face's vertices by its weights."""
        shares = (self.weight * of_samples[:, None]).ravel()
        # Without samples NumPy counts in whole numbers
        return np.bincount(self.corner.ravel(), shares, len(self.vertex_area)).astype(np.float64)

    @cached_property
    def _diagonal(self) -> np.ndarray:
        n, edges = len(self.vertex_area), self.edges
        of_samples = np.bincount(self.corner.ravel(), (self.weight**2 * self.sample_area[:, None]).ravel(), n)
        of_edges = np.bincount(edges.vertex.ravel(), (edges.share**2 * edges.area[:, None]).ravel(), n)
        return of_samples + self.vertex_area + REGULARIZATION * of_edges

    @cached_property
    def _hold(self) -> np.ndarray:
        return _LEAST * self._diagonal + 1e-30

    @cached_property
    def _matrix(self) -> _Matrix:
        return _Matrix(self.corner, self.weight, self.sample_area, self.edges, self.vertex_area + self._hold)

    def _bounds(self, at_vertices: np.ndarray, at_samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The least and the most that each vertex may have, (n, 3): by what has a say on the faces around it."""
        low, high, least, most = (
            np.full((n, 3), bound) for n in (len(at_vertices), len(self.face_corner)) for bound in (np.inf, -np.inf)
        )
        counts = self.sample_area > 0, self.vertex_area > 0
        _range_around(self.face_corner, self.face, at_samples, at_vertices, *counts, least, most, low, high)
        darkest = np.minimum(at_samples.min(axis=0, initial=0), at_vertices.min(axis=0, initial=0))
        unknown = ~np.isfinite(high)
        low, high = np.where(unknown, at_vertices, low), np.where(unknown, at_vertices, high)
        slack = SLACK * (high - low)
        return np.maximum(low - slack, darkest), high + slack

    def _solved(self, right: np.ndarray, value: np.ndarray, fixed: np.ndarray, progress: Progress) -> np.ndarray:
        """The least-squares values where some are fixed, by conjugate gradients for each color."""
        diagonal, left = self._diagonal + self._hold, np.empty(right.shape)
        _multiply(self._matrix, value, left)
        residual = np.where(fixed, 0, right - left)
        way = residual / diagonal[:, None]
        state = value.copy(), residual, way, left
        error, square = np.einsum("nc,nc->c", residual, way), np.zeros(3)
        enough = _TOLERANCE**2 * np.einsum("nc,nc->c", right, right)
        for _ in range(_MOST_STEPS):
            progress.check()
            if (np.einsum("nc,nc->c", residual, residual) <= enough).all():
                break
            _step(self._matrix, diagonal, fixed, *state, error, square)
        return state[0]


@kernel
def _multiply(matrix, value, product):
    _product(matrix, value, product)


@part
def _product(matrix, value, product):
    """The normal matrix times values (n, 3)."""
    for i in range(len(value)):
        put(product, i, times(row(value, i), matrix.of_vertex[i]))
    for i in range(len(matrix.corner)):
        a, b, c = row(matrix.corner, i)
        u, v, w = row(matrix.weight, i)
        shown = plus(plus(times(row(value, a), u), times(row(value, b), v)), times(row(value, c), w))
        shown = times(shown, matrix.sample_area[i])
        add(product, a, times(shown, u))
        add(product, b, times(shown, v))
        add(product, c, times(shown, w))
    vertex, share = matrix.edges.vertex, matrix.edges.share
    for i in range(len(vertex)):
        jump = plus(
            plus(times(row(value, vertex[i, 0]), share[i, 0]), times(row(value, vertex[i, 1]), share[i, 1])),
            plus(times(row(value, vertex[i, 2]), share[i, 2]), times(row(value, vertex[i, 3]), share[i, 3])),
        )
        jump = times(jump, REGULARIZATION * matrix.edges.area[i])
        for j in range(4):
            add(product, vertex[i, j], times(jump, share[i, j]))


@kernel
def _step(matrix, diagonal, fixed, value, residual, way, product, error, square):
    """One step of conjugate gradients along `way`, preconditioned by the diagonal; `error` is residual² / diagonal."""
    _product(matrix, way, product)
    for c in range(3):
        square[c] = 0.0
    for i in range(len(way)):
        for c in range(3):
            square[c] += way[i, c] * product[i, c]
    for c in range(3):
        length_, old, error[c] = error[c] / max(square[c], 1e-300), error[c], 0.0
        for i in range(len(way)):
            if not fixed[i, c]:
                value[i, c] += length_ * way[i, c]
                residual[i, c] -= length_ * product[i, c]
                error[c] += residual[i, c] * residual[i, c] / diagonal[i]
        for i in range(len(way)):
            if not fixed[i, c]:
                way[i, c] = residual[i, c] / diagonal[i] + error[c] / max(old, 1e-300) * way[i, c]


@kernel
def _range_around(corner, face, at_samples, at_vertices, sample_counts, vertex_counts, least, most, low, high):
    """The least and the most of what counts on the faces around each vertex, (n, 3); infinite if nothing does.

    `least` and `most` (t, 3) become those of the faces.
    """
    for i in range(len(face)):
        if sample_counts[i]:
            _widen(least, most, face[i], at_samples, at_samples, i)
    for i in range(len(corner)):
        for j in range(3):
            if vertex_counts[corner[i, j]]:
                _widen(least, most, i, at_vertices, at_vertices, corner[i, j])
    for i in range(len(corner)):
        for j in range(3):
            _widen(low, high, corner[i, j], least, most, i)


@part
def _widen(low, high, i, least, most, j):
    for c in range(3):
        low[i, c], high[i, c] = min(low[i, c], least[j, c]), max(high[i, c], most[j, c])


def inner_edges(faces: ShownFaces, n: int) -> Edges:
    """Edges between two of the triangles, whose vertices are 0 to n − 1."""
    corner = kernel_array(faces.receiver, np.int32)
    left, right = (np.roll(corner, -i, axis=1).ravel().astype(np.int64) for i in (1, 2))
    key = np.minimum(left, right) * n + np.maximum(left, right)
    order = np.argsort(key)
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    start = first[np.diff(first, append=len(key)) == 2]
    halves = order[np.stack([start, start + 1])]
    edges = Edges(np.empty((len(start), 4), np.int32), np.empty((len(start), 4)), np.empty(len(start)))
    _jumps(corner, faces.position.astype(np.float64).reshape(-1, 3), faces.area, halves, edges)
    return edges


@kernel
def _jumps(corner, position, area, halves, edges):
    """Write what values make of h·j at edges, whose halves (2, e) are numbered 3 · triangle + tip.

    A triangle's gradient across an edge is what its tip has more than the foot of its height, over the height h_i. The
    sum over both triangles is j, and h = 2/(1/h_1 + 1/h_2).
    """
    for i in range(len(edges.vertex)):
        one, other = halves[0, i], halves[1, i]
        tip, left, right, foot, height = _half(corner, position, one)
        tip_2, left_2, _, foot_2, height_2 = _half(corner, position, other)
        if left_2 != left:
            foot_2 = 1.0 - foot_2
        mean = 2.0 / (1.0 / height + 1.0 / height_2)
        share, share_2 = mean / height, mean / height_2
        edges.vertex[i, 0], edges.vertex[i, 1], edges.vertex[i, 2], edges.vertex[i, 3] = tip, tip_2, left, right
        edges.share[i, 0], edges.share[i, 1] = share, share_2
        edges.share[i, 2] = share * (foot - 1.0) + share_2 * (foot_2 - 1.0)
        edges.share[i, 3] = -share * foot - share_2 * foot_2
        edges.area[i] = (area[one // 3] + area[other // 3]) / 3.0


@part
def _half(corner, position, half):
    """The vertices of a triangle at a tip and left and right of it; the foot's place between these, and the height."""
    triangle, tip = half // 3, half % 3
    left, right = (tip + 1) % 3, (tip + 2) % 3
    origin = row(position, 3 * triangle + left)
    edge, way = minus(row(position, 3 * triangle + right), origin), minus(row(position, half), origin)
    foot = dot(way, edge) / max(dot(edge, edge), 1e-30)
    height = max(length(minus(way, times(edge, foot))), 1e-12)
    return corner[triangle, tip], corner[triangle, left], corner[triangle, right], foot, height
