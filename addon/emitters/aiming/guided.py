"""Sources' hypercubes cut into cells, of which photons are drawn more where they are worth much.

A photon of a cell c is drawn with the density q_c instead of 1 and carries 1/q_c of its power, so that its mean stays
what it was. The last number of the hypercube chooses the cell.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core.compiling import by_reference, part
from ...core.vec3 import ONE

_BELOW_ONE = np.float32(1 - 2**-24)


@dataclass(frozen=True)
class Guide:
    """How much more often than evenly each cell of a source's hypercube is drawn.

    Attributes
    ----------
    density : float
        In as many dimensions as the hypercube has, with a mean of 1.
    """

    density: np.ndarray

    @staticmethod
    def even() -> "Guide":
        """One cell, as nothing is known."""
        return Guide(np.ones((1, 1, 1, 1, 1)))


@by_reference
class GuideCells(NamedTuple):
    """The cells of s sources.

    Attributes
    ----------
    start : (s + 1,) int64
        Where the cells of each source begin.
    shape : (s, 5) uint32
        How many there are along each dimension.
    cumulative : (c,) float64
        Sums of the density over the number of the source's cells.
    density : (c,) float32
    cutpoints : (c,) int32
        Of numbers in as many even steps as the source has cells, the cell where to look first (Chen and Asau 1974).
    """

    start: np.ndarray
    shape: np.ndarray
    cumulative: np.ndarray
    density: np.ndarray
    cutpoints: np.ndarray


def guide_cells(guides: Sequence[Guide]) -> GuideCells:
    """The cells of sources' guides."""
    densities = [guide.density.ravel() for guide in guides]
    start = np.cumsum([0, *map(len, densities)])
    cumulative = [np.cumsum(density) / len(density) for density in densities]
    cutpoints = [
        np.searchsorted(sums, np.arange(len(sums)) / len(sums) * sums[-1], side="right") + first
        for sums, first in zip(cumulative, start[:-1], strict=True)
    ]
    return GuideCells(
        start,
        np.array([guide.density.shape for guide in guides], np.uint32).reshape(-1, 5),
        np.concatenate([np.zeros(0), *cumulative]),
        np.concatenate([np.zeros(0), *densities]).astype(np.float32),
        np.concatenate([np.zeros(0), *cutpoints]).astype(np.int32),
    )


@part
def guided(cells, source, u):
    """A point of a source's hypercube moved to a cell where photons are worth much, and the density there."""
    first, last = cells.start[source], cells.start[source + 1] - 1
    if first == last:
        return u, ONE
    n = last + 1 - first
    place = np.float64(u[4]) * cells.cumulative[last]
    k = cells.cutpoints[first + min(np.int64(np.float64(u[4]) * n), n - 1)]
    while k < last and cells.cumulative[k] <= place:
        k += 1
    density, cell, shape = cells.density[k], np.uint32(k - first), cells.shape
    within = 1.0 - (cells.cumulative[k] - place) * n / density
    e, cell = _place(cell, min(max(within, 0.0), 1.0), shape[source, 4]), np.uint32(cell // shape[source, 4])
    d, cell = _place(cell, np.float64(u[3]), shape[source, 3]), np.uint32(cell // shape[source, 3])
    c, cell = _place(cell, np.float64(u[2]), shape[source, 2]), np.uint32(cell // shape[source, 2])
    b, cell = _place(cell, np.float64(u[1]), shape[source, 1]), np.uint32(cell // shape[source, 1])
    return (_place(cell, np.float64(u[0]), shape[source, 0]), b, c, d, e), density


@part
def _place(cell, within, n):
    """Along a dimension of n cells, the place within the one that a cell's number says."""
    return min(np.float32((np.float64(cell % n) + within) / np.float64(n)), _BELOW_ONE)
