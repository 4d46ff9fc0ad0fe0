"""Points sorted into rows, so that those in a box are a few runs of them."""

from typing import NamedTuple

import numpy as np

from ...core.compiling import by_reference, kernel, part
from ...core.vec3 import minus, mul, row

_BITS = 20  # of a point's place along each axis
_STEPS = 1 << _BITS


@by_reference
class PointRows(NamedTuple):
    """Points in rows along x, which are `side` high and wide (or more, of scenes that are very large for it).

    Attributes
    ----------
    low, per_metre : triples of float32
        Lowest corner, m; steps a metre along each axis.
    last : triple of int
        Last step along each axis.
    keys : (n,) int64
        Of the points, in order: row by row, then along x.
    """

    low: tuple[np.float32, ...]
    per_metre: tuple[np.float32, ...]
    last: tuple[int, ...]
    keys: np.ndarray

    @staticmethod
    def of(points: np.ndarray, side: float) -> "tuple[PointRows, np.ndarray]":
        """Rows of at least one point (n, 3) float32, and the points' order, (n,) int64."""
        low = points.min(axis=0)
        extent = np.maximum(points.max(axis=0).astype(np.float64) - low, 1e-30)
        per_metre = np.minimum(np.array([np.inf, 1 / side, 1 / side]), (_STEPS - 1) / extent)
        last = (extent * per_metre).astype(np.int64)
        rows = PointRows(tuple(low), tuple(per_metre.astype(np.float32)), tuple(last.tolist()), np.empty(0, np.int64))
        keys = rows.keys_of(points)
        order = np.argsort(keys, kind="stable")
        return rows._replace(keys=keys[order]), order

    def keys_of(self, points: np.ndarray) -> np.ndarray:
        """Keys of any points (m, 3) float32, by which they come into the same order, (m,) int64."""
        keys = np.empty(len(points), np.int64)
        _find_keys(self, points, keys)
        return keys


@part
def steps(rows, point):
    """How many steps along x, and which row along y and z, a point is; what lies outside goes to the border."""
    x, y, z = mul(minus(point, rows.low), rows.per_metre)
    last = rows.last
    return _clipped(x, last[0]), _clipped(y, last[1]), _clipped(z, last[2])


@part
def _clipped(x, last):
    return np.int64(min(max(x, np.float32(0)), np.float32(last)))


@part
def key(x, y, z):
    """Number of a step along a row."""
    return (z << 2 * _BITS) + (y << _BITS) + x


@part
def first_from(keys, wanted, start, stop):
    """The first of the sorted keys from `start` to `stop` that is no less than the wanted one."""
    while start < stop:
        middle = (start + stop) >> 1
        if keys[middle] < wanted:
            start = middle + 1
        else:
            stop = middle
    return start


@kernel
def _find_keys(rows, points, keys):
    for k in range(len(points)):
        x, y, z = steps(rows, row(points, k))
        keys[k] = key(x, y, z)
