"""Drawing cells by their chances: cumulative chances inverted, with a guide to where to look (Chen and Asau 1974)."""

import numpy as np


class Inversion:
    """Rows of cells, each row with chances of its own.

    Parameters
    ----------
    cumulative : (r, n) float
        Cumulative chances along each row, up to 1.
    """

    def __init__(self, cumulative: np.ndarray) -> None:
        n_rows, self._n_cells = cumulative.shape
        first = np.arange(n_rows, dtype=np.float64)[:, None]
        # Each row is higher by its index, so that all rows together are sorted
        self._cumulative = (cumulative + first).ravel()
        # A power of two, so that a number never lies below the start of its bucket by rounding
        self._n_buckets = 1 << (self._n_cells - 1).bit_length()
        starts = first + np.arange(self._n_buckets) / self._n_buckets
        self._guide = self._search(starts.ravel()).astype(np.int32)

    def cells(self, row: np.ndarray | int, u: np.ndarray) -> np.ndarray:
        """The cell in its row that each of the numbers `u` (m,) in [0, 1) falls into, (m,) int64."""
        at, bucket = row + u.astype(np.float64), row * self._n_buckets + (u * self._n_buckets).astype(np.int64)
        cell = self._guide[bucket].astype(np.int64)
        cell += self._cumulative[cell] <= at
        # Most numbers are in one of their bucket's first two cells
        rest = np.flatnonzero(self._cumulative[np.minimum(cell, len(self._cumulative) - 1)] <= at)
        cell[rest] = self._search(at[rest])
        first = row * self._n_cells
        return np.clip(cell - first, 0, self._n_cells - 1)

    def invert(self, row: np.ndarray | int, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Also where in its cell each number lies, (m,) float64 in [0, 1)."""
        cell = self.cells(row, u)
        place = row * self._n_cells + cell
        low = np.where(cell > 0, self._cumulative[place - 1], row)
        within = (row + u.astype(np.float64) - low) / np.maximum(self._cumulative[place] - low, 1e-300)
        return cell, np.clip(within, 0, 1 - 1e-7)

    def _search(self, at: np.ndarray) -> np.ndarray:
        """The first cell whose cumulative chance is above, among all rows' cells."""
        return np.minimum(np.searchsorted(self._cumulative, at, side="right"), len(self._cumulative) - 1)
