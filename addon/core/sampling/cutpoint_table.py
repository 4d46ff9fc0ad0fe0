"""Drawing cells by their chances: cumulative chances inverted, with a table of where to look (Chen and Asau 1974)."""

from typing import NamedTuple

import numpy as np

from ..compiling import by_reference, part


@by_reference
class CutpointTable(NamedTuple):
    """r rows of n cells, each row with chances of its own.

    Attributes
    ----------
    cumulative : (r n,) float64
        Cumulative chances along each row, up to 1, and the row's index, so that all rows together are sorted.
    first : (r b,) int32
        Of b even steps of each row's numbers, the cell among all rows' where to look first.
    n_cells, n_buckets : int
    """

    cumulative: np.ndarray
    first: np.ndarray
    n_cells: int
    n_buckets: int


def cutpoint_table(cumulative: np.ndarray) -> CutpointTable:
    """The table of cumulative chances (r, n) along each row, up to 1; without cells it draws nothing."""
    n_rows, n_cells = cumulative.shape
    base = np.arange(n_rows, dtype=np.float64)[:, None]
    raised = (cumulative + base).ravel()
    # A power of two, so that a number never lies below the start of its bucket by rounding
    n_buckets = 1 << max(n_cells - 1, 0).bit_length()
    starts = (base + np.arange(n_buckets) / n_buckets).ravel()
    first = np.minimum(np.searchsorted(raised, starts, side="right"), max(len(raised) - 1, 0))
    return CutpointTable(raised, first.astype(np.int32), n_cells, n_buckets)


@part
def drawn_cell(table, row, u):
    """The cell of a row that a number in [0, 1) falls into."""
    at = np.float64(row) + np.float64(u)
    k = np.int64(table.first[row * table.n_buckets + np.int64(np.float64(u) * table.n_buckets)])
    start = row * table.n_cells
    last = start + table.n_cells - 1
    while k < last and table.cumulative[k] <= at:
        k += 1
    return max(k - start, 0)


@part
def chance_of(table, row, cell):
    """The chance of a cell of a row."""
    k = row * table.n_cells + cell
    return table.cumulative[k] - (table.cumulative[k - 1] if cell > 0 else np.float64(row))


@part
def drawn_place(table, row, u):
    """As `drawn_cell`, and where in its cell the number lies, float64 in [0, 1)."""
    cell = drawn_cell(table, row, u)
    above, chance = table.cumulative[row * table.n_cells + cell], chance_of(table, row, cell)
    within = (np.float64(row) + np.float64(u) - (above - chance)) / max(chance, 1e-300)
    return cell, min(max(within, 0.0), 1.0 - 1e-7)
