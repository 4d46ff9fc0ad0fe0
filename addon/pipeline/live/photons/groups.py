"""Groups of photons that set out alike: one of each is traced again now and then, and stands for the others.

A group is a cell of its source's hypercube, which is cut along the numbers that decide where light arrives: first
directions of a lamp, places in the beam of the sun. Photons start from the points of a Sobol sequence, of which each
cell gets about as many.
"""

from collections.abc import Sequence

import numpy as np

from ....core.compiling import kernel
from ....core.vec3 import mean, row
from ....emitters import Source
from ....photons.emission import Emission
from .paths import PathArrays, is_there

_N_GROUPS = 4096  # of all sources together, about
_LEAST, _MOST = 2, 16  # cells along a dimension


class Groups:
    """Which photons are of which group.

    Attributes
    ----------
    n : int
    of_photon : (p,) int32
    """

    def __init__(self, sources: Sequence[Source], emission: Emission) -> None:
        side = int(np.clip(np.sqrt(_N_GROUPS / max(2 * len(sources), 1)), _LEAST, _MOST))
        numbers, n = [], 0
        for k, source in enumerate(sources):
            shape = np.minimum(source.n_cells, side)
            u = emission.points(k)
            cells = np.minimum((u * shape).astype(np.int64), shape - 1)
            numbers.append(n + np.ravel_multi_index(tuple(cells.T), tuple(int(m) for m in shape)))
            n += int(np.prod(shape))
        _, number = np.unique(np.concatenate(numbers), return_inverse=True)
        self.of_photon = number.astype(np.int32)
        self.n = int(number.max()) + 1
        self._order = np.argsort(number, kind="stable")
        self._start = np.searchsorted(number[self._order], np.arange(self.n + 1))

    def turn(self, k: int) -> np.ndarray:
        """The k-th photon of each group, or one before it where there are fewer, (n,) int64, which rise."""
        counts = np.diff(self._start)
        return np.sort(self._order[self._start[:-1] + k % counts])

    def photons(self, group: int) -> np.ndarray:
        """All of a group, which rise, (m,) int64."""
        return self._order[self._start[group] : self._start[group + 1]]

    def energy(self, paths: PathArrays) -> np.ndarray:
        """What the photons of each group bring, the mean over colours, (n,) float64, W."""
        energy = np.zeros(self.n)
        _add_energy(paths, self.of_photon, energy)
        return energy


@kernel
def _add_energy(paths, group, energy):
    for i in range(len(group)):
        if is_there(paths, i):
            for k in range(paths.n_surfaces[i]):
                energy[group[i]] += abs(mean(row(paths.power[i], k)))
