"""Points sorted into rows, so that those in a box are a few runs of them."""

import numpy as np

from ...core.ranges import unrolled

_BITS = 20  # of a point's place along each axis
_STEPS = 1 << _BITS


class PointRows:
    """Points in rows along x, which are `side` high and wide (or more, of scenes that are very large for it).

    Parameters
    ----------
    points : (n, 3) float32, m
        At least one.
    side : float, m

    Attributes
    ----------
    order : (n,) int64
        The points, sorted by row, then along x.
    """

    def __init__(self, points: np.ndarray, side: float) -> None:
        self._low = points.min(axis=0).astype(np.float64)
        extent = np.maximum(points.max(axis=0) - self._low, 1e-30)
        self._per_metre = np.minimum(np.array([np.inf, 1 / side, 1 / side]), (_STEPS - 1) / extent)
        self._last = (extent * self._per_metre).astype(np.int64)
        keys = self._key(*self._steps(points).T)
        self.order = np.argsort(keys, kind="stable")
        self._keys = keys[self.order]

    def along(self, points: np.ndarray) -> np.ndarray:
        """Indices that bring other points (m, 3) into the same order, (m,) int64."""
        return np.argsort(self._key(*self._steps(points).T), kind="stable")

    def runs(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Where the points in boxes may be.

        Parameters
        ----------
        low, high : (b, 3) float32, m
            Corners of the boxes.

        Returns
        -------
        box, start, stop : (r,) int64
            Points `start` to `stop` of `order` lie in the box, or beside it in the same row.
        """
        (x0, y0, z0), (x1, y1, z1) = self._steps(low).T, self._steps(high).T
        box, k = unrolled((y1 - y0 + 1) * (z1 - z0 + 1))
        z, y = np.divmod(k, (y1 - y0 + 1)[box])
        row = self._key(np.int64(0), y0[box] + y, z0[box] + z)
        start, stop = np.searchsorted(self._keys, row + x0[box]), np.searchsorted(self._keys, row + x1[box] + 1)
        some = np.flatnonzero(stop > start)
        return box[some], start[some], stop[some]

    def _steps(self, points: np.ndarray) -> np.ndarray:
        """How many steps along x, and which row, (n, 3) int64; what lies outside goes to the border."""
        steps = np.clip((points - self._low) * self._per_metre, 0, self._last)
        return steps.astype(np.int64)

    @staticmethod
    def _key(x: np.ndarray | np.int64, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        return (z << 2 * _BITS) + (y << _BITS) + x
