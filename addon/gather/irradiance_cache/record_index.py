"""Which records a receiver looks at, and how much each counts."""

from typing import NamedTuple

import numpy as np

from ...core.compiling import kernel, kernel_array, part
from ...core.nearest import PointTree, find_nearest, new_search
from ...core.parallel import Workers
from ...core.vec3 import ONE, ZERO, along, dot, frame, length, minus, plus, row, times
from ...scene import RayKind
from ...tracing.embree import EmbreeTracer, new_ray, occluded_between
from .records import STAGE, Records
from .weights import Weights

_N_NEIGHBOURS = 12
_REACH = np.float32(1.5)  # edges of its cell, as far as a record counts
_TILT = np.float32(0.7)  # difference of unit normals at which a record counts no more
_HEIGHT = np.float32(0.5)  # of its reach, above or below the tangent plane, at which it counts no more
_RIDGE = np.float32(0.005)  # of the squared reach, added to the covariance: how far few records may be extrapolated
_LEAST, _TINY = np.float32(1e-6), np.float32(1e-20)
_HALF = np.float32(0.5)
_NOBODY = np.int32(-1)
_CHUNK = 1 << 13
_POINT_BYTES = 16 * _N_NEIGHBOURS  # of the rows of a point


class _Places(NamedTuple):
    """Where records are, for kernels: as in `Records`, with a tree over them."""

    tree: PointTree
    position: np.ndarray
    normal: np.ndarray
    edge: np.ndarray


class _Fit(NamedTuple):
    """Memory for the records that a point looks at: numbers, weights and places in its tangent plane, (k,) each."""

    record: np.ndarray
    weight: np.ndarray
    x: np.ndarray
    y: np.ndarray


class RecordIndex:
    """Finds the records around points.

    Parameters
    ----------
    extent : float, m
        Of the receivers: as far away as this, a record that faces the same way is preferred to one at the same place
        that is turned by 57°.
    tracer : EmbreeTracer
        For whether a point sees a record.
    lift : float
        Over the distance between two points: how high above the middle between them they look at each other. With 0,
        surfaces that bulge are in the way; else, what lies close above a flat one.
    """

    def __init__(self, records: Records, extent: float, tracer: EmbreeTracer, lift: float = 0.2) -> None:
        self.records, self._tracer, self._lift = records, tracer, np.float32(lift / 2)
        position, normal, edge = (
            kernel_array(values, np.float32) for values in (records.position, records.normal, records.edge)
        )
        self._places = _Places(PointTree.of(position, normal, extent), position, normal, edge)

    def of_points(self, position: np.ndarray, normal: np.ndarray, workers: Workers) -> Weights:
        """Weights of the records for points (n, 3) with unit normals (n, 3)."""
        return self._weights(position, normal, np.full(len(position), _NOBODY), workers)

    def of_records(self, which: np.ndarray, workers: Workers) -> Weights:
        """What the others say of some of the records: weights without their own."""
        at = self.records.position[which], self.records.normal[which]
        return self._weights(*at, which.astype(np.int32), workers)

    def _weights(self, position: np.ndarray, normal: np.ndarray, without: np.ndarray, workers: Workers) -> Weights:
        k, tree = min(_N_NEIGHBOURS, len(self.records)), self._tracer.handles[RayKind.SHADOW]
        position, normal = kernel_array(position, np.float32), kernel_array(normal, np.float32)

        def look(chunk: slice, _: np.random.Generator) -> Weights:
            n, at = chunk.stop - chunk.start, (position[chunk], normal[chunk], without[chunk])
            rows = Weights(np.zeros(n + 1, np.int32), np.empty(n * k, np.int32), np.empty(n * k, np.float32))
            fit = _Fit(np.empty(k, np.int32), *np.empty((3, k), np.float32))
            end = _look(self._places, tree, new_ray(), new_search(k), self._lift, *at, fit, rows) if k else 0
            return Weights(rows.start, rows.record[:end].copy(), rows.weight[:end].copy())

        chunks = workers.chunks(STAGE, len(position), _CHUNK, look, (), row_bytes=_POINT_BYTES)
        return Weights.joined([Weights.none(0), *(rows for _, rows in chunks)])


@kernel
def _look(places, tree, room, search, lift, position, normal, without, fit, rows):
    """Write the weights of points as compressed rows; returns how many entries there are."""
    end = 0
    for i in range(len(position)):
        at, up = row(position, i), row(normal, i)
        find_nearest(places.tree, search, at, up, ONE)
        n = _in_reach(places, tree, room, search, lift, at, up, without[i], fit)
        n = _fit_plane(places, at, up, fit, n)
        for j in range(n):
            rows.record[end], rows.weight[end] = fit.record[j], fit.weight[j]
            end += 1
        rows.start[i + 1] = end
    return end


@part
def _in_reach(places, tree, room, search, lift, at, up, without, fit):
    """Put the records that a point sees into `fit`, with a bump over the reach of each; returns how many."""
    n = 0
    for j in range(len(search.number)):
        record = search.number[j]
        weight = _closeness(places, record, at, up)
        if weight > ZERO and record != without and _sees(places, tree, room, lift, at, up, record):
            fit.record[n], fit.weight[n] = record, weight
            n += 1
    return n


@part
def _closeness(places, record, at, up):
    """How much a record counts by its distance, tilt and height over the tangent plane of a point."""
    way = minus(row(places.position, record), at)
    reach = _REACH * places.edge[record]
    weight = _bump(length(way) / reach) * _bump(length(minus(row(places.normal, record), up)) / _TILT)
    weight *= _bump(dot(way, up) / (_HEIGHT * reach))
    return weight * weight


@part
def _bump(x):
    """1 − x² where that is positive, and 0 elsewhere."""
    return max(ONE - x * x, ZERO)


@part
def _sees(places, tree, room, lift, at, up, record):
    """Whether a point sees a record by way of a place above the middle between them."""
    there = row(places.position, record)
    way = minus(there, at)
    above = times(plus(up, row(places.normal, record)), lift * length(way))
    middle = plus(along(at, _HALF, way), above)
    return not occluded_between(tree, room, at, middle) and not occluded_between(tree, room, there, middle)


@part
def _fit_plane(places, at, up, fit, n):
    """Weights that give the value at a point of the plane that fits best in the least squares weighted by `fit`.

    With w that sum to one, coordinates t in the tangent plane and t̄ = Σ w t, these are l = w (1 − t̄ᵀ S⁻¹ (t − t̄)),
    S = Σ w (t − t̄)(t − t̄)ᵀ + ridge, with lengths in units of the root mean square reach. Returns how many are not 0.
    """
    total, unit2 = ZERO, ZERO
    for j in range(n):
        reach = _REACH * places.edge[fit.record[j]]
        total += fit.weight[j]
        unit2 += fit.weight[j] * reach * reach
    if not total > _LEAST:
        return 0
    unit = max(np.sqrt(unit2 / total), _TINY)
    tangent, bitangent = frame(up)
    mean_x, mean_y = ZERO, ZERO
    for j in range(n):
        way = times(minus(row(places.position, fit.record[j]), at), ONE / unit)
        fit.weight[j] /= total
        fit.x[j], fit.y[j] = dot(way, tangent), dot(way, bitangent)
        mean_x += fit.weight[j] * fit.x[j]
        mean_y += fit.weight[j] * fit.y[j]
    xx, yy, xy = _RIDGE, _RIDGE, ZERO
    for j in range(n):
        x, y = fit.x[j] - mean_x, fit.y[j] - mean_y
        xx += fit.weight[j] * x * x
        yy += fit.weight[j] * y * y
        xy += fit.weight[j] * x * y
    determinant = xx * yy - xy * xy
    a, b = (yy * mean_x - xy * mean_y) / determinant, (xx * mean_y - xy * mean_x) / determinant
    kept = 0
    for j in range(n):
        weight = fit.weight[j] * (ONE - a * (fit.x[j] - mean_x) - b * (fit.y[j] - mean_y))
        if weight != ZERO:
            fit.record[kept], fit.weight[kept] = fit.record[j], weight
            kept += 1
    return kept
