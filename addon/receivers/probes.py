"""Places of light probes: points in the air, in grids or alone, which want light from all around."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .receivers import Receivers

_SIDES = np.concatenate([np.eye(3), -np.eye(3)]).astype(np.float32)
_FOOTPRINT = 1e-3  # m: a probe is a point

WIDER = 3.0
_LEAST_INSIDE = 2  # boxes that there are in what is filled


@dataclass(frozen=True)
class ProbeGrid:
    """A box of probes, one in the middle of each of its cells: as the texels of a 3D texture that fills the box.

    Attributes
    ----------
    name : str
    matrix : (4, 4) float64
        From the texture's coordinates, 0 to 1 along each side, to world space.
    counts : tuple of int
        Cells along each side.
    """

    name: str
    matrix: np.ndarray
    counts: tuple[int, int, int]

    @property
    def n_probes(self) -> int:
        return int(np.prod(self.counts))

    @property
    def positions(self) -> np.ndarray:
        """In world space, (n, 3) float32, m; x changes fastest, then y, then z."""
        steps = [(np.arange(n) + 0.5) / n for n in self.counts]
        z, y, x = np.meshgrid(*reversed(steps), indexing="ij")
        inside = np.stack([x, y, z], axis=-1).reshape(-1, 3)
        return (inside @ self.matrix[:3, :3].T + self.matrix[:3, 3]).astype(np.float32)


@dataclass(frozen=True)
class ProbePlaces:
    """Where all probes lie: those of grids, one after the other, and then lone ones.

    Attributes
    ----------
    grids : tuple of ProbeGrid
    names : tuple of str
        Of the lone ones.
    points : (p, 3) float32, m
        In world space.
    """

    grids: tuple[ProbeGrid, ...]
    names: tuple[str, ...]
    points: np.ndarray

    @property
    def positions(self) -> np.ndarray:
        """(n, 3) float32, m."""
        return np.concatenate([*(grid.positions for grid in self.grids), self.points.reshape(-1, 3)])

    def __len__(self) -> int:
        return sum(grid.n_probes for grid in self.grids) + len(self.names)

    def eyes(self) -> Receivers:
        """Receivers that look to all six sides of each probe: what they see has to be lit."""
        positions = np.repeat(self.positions, len(_SIDES), axis=0)
        normals = np.tile(_SIDES, (len(self), 1))
        return Receivers(positions, normals, np.full(len(positions), _FOOTPRINT, np.float32))


def grid_in_box(name: str, low: Sequence[float], high: Sequence[float], spacing: float, most: int) -> ProbeGrid:
    """A grid that fills a box (3,) to (3,) of world space, m: as close as `spacing`, but of at most so many probes."""
    low_, size = np.array(low, np.float64), np.maximum(np.subtract(high, low), 0.0)
    counts = _counts(size, spacing)
    while counts.prod() > most:
        spacing *= max((counts.prod() / most) ** (1 / 3), 1.01)
        counts = _counts(size, spacing)
    matrix = np.diag([*np.maximum(size, 1e-6), 1.0])
    matrix[:3, 3] = low_
    return ProbeGrid(name, matrix, (int(counts[0]), int(counts[1]), int(counts[2])))


def without_surroundings(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Which boxes (n, 3) to (n, 3) are not the wide surroundings of the others, as ground and skies are, (n,) bool.

    Boxes join from the smallest to the largest. Where one of the largest tenth makes what holds them all `WIDER` times
    as wide, it and those that are larger are left out.
    """
    n = len(low)
    order = np.argsort(np.linalg.norm(high - low, axis=1), kind="stable")
    lows, highs = np.minimum.accumulate(low[order]), np.maximum.accumulate(high[order])
    width = np.linalg.norm(highs - lows, axis=1)
    first = max(n - max(n // 10, 1), _LEAST_INSIDE)
    wide = first + np.flatnonzero(width[first:] > WIDER * width[first - 1 : -1]) if n > first else np.zeros(0, int)
    keep = np.ones(n, bool)
    if len(wide):
        keep[order[wide[0] :]] = False
    return keep


def _counts(size: np.ndarray, spacing: float) -> np.ndarray:
    return np.maximum(np.ceil(size / spacing - 1e-6), 1).astype(np.int64)
