"""Where photons are stored: arrays that kernels write into, a photon a row, and that grow with the photons."""

from dataclasses import fields
from typing import NamedTuple

import numpy as np

from ..core.compiling import by_reference, part
from ..core.sampling.octahedral import octahedral_code
from ..core.vec3 import put
from .photons import PathKind, Photons

_DIRECT, _INDIRECT, _CAUSTIC = (int(kind) for kind in PathKind)
_MARGIN = 1.1  # over the photons that are expected from those that are there


@by_reference
class StoreArrays(NamedTuple):
    """The columns of `Photons`, of which more rows exist than are written."""

    position: np.ndarray
    power: np.ndarray
    packed_direction: np.ndarray
    packed_normal: np.ndarray
    triangle: np.ndarray
    path: np.ndarray
    path_density: np.ndarray
    kind: np.ndarray
    bounce: np.ndarray


@part
def store(rows, k, hit, photon, bounce):
    """Write a photon that met a surface into the k-th row."""
    put(rows.position, k, hit.position)
    put(rows.power, k, photon.power)
    rows.packed_direction[k, 0], rows.packed_direction[k, 1] = octahedral_code(photon.direction)
    rows.packed_normal[k, 0], rows.packed_normal[k, 1] = octahedral_code(hit.normal)
    rows.triangle[k], rows.path[k], rows.path_density[k] = hit.triangle, photon.path, photon.path_density
    rows.kind[k] = _CAUSTIC if photon.specular else (_INDIRECT if bounce > 0 else _DIRECT)
    rows.bounce[k] = min(bounce, 255)


class PhotonStore:
    """Photons that become ever more; `n` are stored."""

    def __init__(self) -> None:
        self.n = 0
        none = Photons.none()
        self._columns = [np.array(getattr(none, f.name)) for f in fields(Photons)]

    def rows(self, n_more: int) -> StoreArrays:
        """The columns, with room for so many more photons from row `n` on."""
        if self.n + n_more > len(self._columns[0]):
            self._make_room(max(self.n + n_more, 2 * self.n))
        return StoreArrays(*self._columns)

    def add(self, photons: Photons, done: float) -> None:
        """Store a copy of photons after all others; with them, a share `done` of all is there, about.

        Room for the rest is made at once: what is not written takes no memory.
        """
        n = self.n + len(photons)
        if n > len(self._columns[0]):
            self._make_room(int(n * _MARGIN / done))
        for column, f in zip(self._columns, fields(Photons), strict=True):
            column[self.n : n] = getattr(photons, f.name)
        self.n = n

    def photons(self) -> Photons:
        """All that are stored; the store is not to be used any more.

        Rows that were never written take no memory.
        """
        return Photons(*(column[: self.n] for column in self._columns))

    def _make_room(self, n: int) -> None:
        for i, column in enumerate(self._columns):
            self._columns[i] = np.empty((n, *column.shape[1:]), column.dtype)
            self._columns[i][: self.n] = column[: self.n]
