"""Which records a receiver looks at, and how much each counts."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ...core.parallel import Workers, slices
from ...core.sampling.vectors import dot, rows
from ...core.sampling.warps import frame
from ...tracing import Tracer
from .records import STAGE, Records

_N_NEIGHBOURS = 12
_REACH = 1.5  # edges of its cell, as far as a record counts
_TILT = 0.7  # difference of unit normals at which a record counts no more
_HEIGHT = 0.5  # of its reach, above or below the tangent plane, at which it counts no more
_RIDGE = 0.005  # of the squared reach, added to the covariance: how far few records may be extrapolated
_CHUNK = 1 << 15
_POINT_BYTES = 2000  # a point takes, with the records around it


@dataclass(frozen=True)
class Weights:
    """What each of n points takes from k records.

    Attributes
    ----------
    record : (n, k) int32
    weight : (n, k) float32
        They sum to one and may be negative; all are 0 where the point has no record to look at.
    """

    record: np.ndarray
    weight: np.ndarray

    @staticmethod
    def identity(receiver: np.ndarray) -> "Weights":
        """Of points that each are a record, which holds that of the point `receiver` (m,)."""
        return Weights.of_one(np.argsort(receiver))

    @staticmethod
    def of_one(record: np.ndarray) -> "Weights":
        """Of points that take one record (n,) each."""
        return Weights(record.astype(np.int32)[:, None], np.ones((len(record), 1), np.float32))

    @property
    def supported(self) -> np.ndarray:
        """Which points have records to look at, (n,) bool."""
        return self.weight.any(axis=1)

    def apply(self, values: np.ndarray) -> np.ndarray:
        """Weighted sums of the records' values (m, …), (n, …)."""
        sums = np.empty((len(self.record), *values.shape[1:]), np.result_type(self.weight, values))
        for part in slices(len(sums), _CHUNK):
            of_records = rows(values, self.record[part])
            np.einsum("nk,nk...->n...", self.weight[part], of_records, out=sums[part])
        return sums

    def square(self) -> "Weights":
        """Squared weights: what variances are summed with."""
        return Weights(self.record, self.weight**2)

    def mean(self) -> "Weights":
        """Weights without the negative ones, that sum to one: for what must stay positive."""
        positive = np.maximum(self.weight, 0)
        return Weights(self.record, positive / np.maximum(positive.sum(axis=1, keepdims=True), 1e-30))

    def column_sums(self, n_records: int) -> np.ndarray:
        """Sum over the points of what they take from each record, (m,) float64."""
        return np.bincount(self.record.ravel(), self.weight.ravel(), n_records)


class Neighbourhood:
    """Finds the records around points.

    Parameters
    ----------
    extent : float, m
        Of the receivers: as far away as this, a record that faces the same way is preferred to one at the same place
        that is turned by 57°.
    tracer : Tracer
        For whether a point sees a record.
    lift : float
        Over the distance between two points: how high above the middle between them they look at each other. With 0,
        surfaces that bulge are in the way; else, what lies close above a flat one.
    """

    def __init__(self, records: Records, extent: float, tracer: Tracer, lift: float = 0.2) -> None:
        self.records, self._extent, self._tracer, self._lift = records, np.float32(extent), tracer, np.float32(lift)
        self._tree = cKDTree(self._place(records.position, records.normal))

    def of_points(self, position: np.ndarray, normal: np.ndarray, workers: Workers) -> Weights:
        """Weights of the records for points (n, 3) with unit normals (n, 3)."""
        return self._weights(position, normal, None, workers)

    def of_records(self, which: np.ndarray, workers: Workers) -> Weights:
        """What the others say of some of the records: weights without their own."""
        return self._weights(self.records.position[which], self.records.normal[which], which, workers)

    def _weights(
        self, position: np.ndarray, normal: np.ndarray, without: np.ndarray | None, workers: Workers
    ) -> Weights:
        k = min(_N_NEIGHBOURS, len(self.records))
        record, weight = np.zeros((len(position), k), np.int32), np.zeros((len(position), k), np.float32)

        def look(chunk: slice, _: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
            return self._look(position[chunk], normal[chunk], None if without is None else without[chunk])

        for chunk, (near, w) in workers.chunks(STAGE, len(position), _CHUNK, look, (), row_bytes=_POINT_BYTES):
            record[chunk], weight[chunk] = near, w
        return Weights(record, weight)

    def _place(self, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
        return np.concatenate([position, self._extent * normal], axis=1)

    def _look(
        self, position: np.ndarray, normal: np.ndarray, without: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """The records nearest to points, and their weights: a bump over the reach of each, then a linear fit."""
        records, k = self.records, min(_N_NEIGHBOURS, len(self.records))
        _, near = self._tree.query(self._place(position, normal), k)
        near = near.reshape(len(position), k).astype(np.int32)
        way = rows(records.position, near) - position[:, None]
        distance2 = np.einsum("nki,nki->nk", way, way)
        reach = np.float32(_REACH) * records.edge[near]
        tilt = rows(records.normal, near) - normal[:, None]
        height = np.einsum("nki,ni->nk", way, normal)
        w = _bump(np.sqrt(distance2) / reach)
        w *= _bump(np.sqrt(np.einsum("nki,nki->nk", tilt, tilt)) / np.float32(_TILT))
        w *= _bump(height / (np.float32(_HEIGHT) * reach))
        w *= w
        if without is not None:
            w[near == without[:, None]] = 0
        self._hide(w, near, position, normal, way)
        total = w.sum(axis=1, keepdims=True)
        w = np.where(total > 1e-6, w / np.maximum(total, np.float32(1e-6)), 0)
        return near, _linear(w, way, normal, reach)

    def _hide(self, w: np.ndarray, near: np.ndarray, position: np.ndarray, normal: np.ndarray, way: np.ndarray) -> None:
        """Take the weight of records that the points do not see, by way of a place above the middle between them."""
        records, tracer = self.records, self._tracer
        i, j = np.nonzero(w > 0)
        k = near[i, j]
        start, way = rows(position, i), rows(way.reshape(-1, 3), i * w.shape[1] + j)
        lift = self._lift / 2 * np.sqrt(dot(way, way))[:, None]
        middle = start + way / 2 + lift * (rows(normal, i) + rows(records.normal, k))
        hidden = tracer.occluded(start, middle)
        seen = np.flatnonzero(~hidden)
        hidden[seen] = tracer.occluded(rows(records.position, k[seen]), rows(middle, seen))
        w[i[hidden], j[hidden]] = 0


def _bump(x: np.ndarray) -> np.ndarray:
    """1 − x² where that is positive, and 0 elsewhere; x may be huge."""
    return 1 - np.minimum(np.abs(x), np.float32(1)) ** 2


def _linear(w: np.ndarray, way: np.ndarray, normal: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Weights that give the value at 0 of the plane that fits best in the least squares weighted by `w` (n, k).

    With w that sum to one, coordinates t in the tangent plane and t̄ = Σ w t, these are l = w (1 − t̄ᵀ S⁻¹ (t − t̄)),
    S = Σ w (t − t̄)(t − t̄)ᵀ + ridge, with lengths in units of the root mean square reach.
    """
    tangent, bitangent = frame(normal)
    unit = np.maximum(np.sqrt(_sums(w, reach**2)), np.float32(1e-20))[:, None]
    way = np.where(w[..., None] > 0, way, 0) / unit[..., None]
    x, y = np.einsum("nki,ni->nk", way, tangent), np.einsum("nki,ni->nk", way, bitangent)
    mean_x, mean_y = _sums(w, x), _sums(w, y)
    x -= mean_x[:, None]
    y -= mean_y[:, None]
    ridge = np.float32(_RIDGE)
    wx, wy = w * x, w * y
    xx, yy, xy = _sums(wx, x) + ridge, _sums(wy, y) + ridge, _sums(wx, y)
    determinant = xx * yy - xy * xy
    a, b = (yy * mean_x - xy * mean_y) / determinant, (xx * mean_y - xy * mean_x) / determinant
    return w - a[:, None] * wx - b[:, None] * wy


def _sums(w: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Σ w x along rows of some length, (n,)."""
    return np.einsum("nk,nk->n", w, x)
