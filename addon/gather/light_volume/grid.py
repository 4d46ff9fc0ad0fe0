"""A grid of cubes over a box, and how points find their cells."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core.compiling import part
from ...core.vec3 import minus, times

_ASIDE = (0.137, 0.071, 0.193)  # cells along x, y and z
_HALF = np.float32(0.5)


class GridArrays(NamedTuple):
    """What kernels know of a `Grid`: its lowest corner, the edge of a cell and one over it, cells along each axis."""

    low: tuple[np.float32, ...]
    length: np.float32
    per_length: np.float32
    shape: tuple[int, int, int]


@part
def in_cells(grid, point):
    """A point in cells from the lowest corner."""
    return times(minus(point, grid.low), grid.per_length)


@part
def cell_at(grid, i, j, k):
    """Number of a cell by its place along x, y and z, counted along z first; −1 outside the grid."""
    nx, ny, nz = grid.shape
    inside = 0 <= i < nx and 0 <= j < ny and 0 <= k < nz
    return np.int32((i * ny + j) * nz + k if inside else -1)


@part
def cell_of(grid, point):
    """The cell that a point lies in; −1 outside the grid."""
    x = in_cells(grid, point)
    return cell_at(grid, np.int64(np.floor(x[0])), np.int64(np.floor(x[1])), np.int64(np.floor(x[2])))


@part
def centre_at(grid, i, j, k):
    """Centre of a cell by its place along x, y and z, m."""
    x = np.float32(i) + _HALF, np.float32(j) + _HALF, np.float32(k) + _HALF
    low = grid.low
    return low[0] + x[0] * grid.length, low[1] + x[1] * grid.length, low[2] + x[2] * grid.length


@part
def centre_of(grid, cell):
    """Centre of a cell by its number, m."""
    _, ny, nz = grid.shape
    return centre_at(grid, cell // (ny * nz), cell // nz % ny, cell % nz)


@dataclass(frozen=True)
class Grid:
    """Cubes in rows along the axes of the world.

    Attributes
    ----------
    low : (3,) float32, m
        Lowest corner.
    length : float, m
        l, the edge of a cell.
    shape : tuple of int
        Cells along x, y and z.
    """

    low: np.ndarray
    length: float
    shape: tuple[int, int, int]

    @staticmethod
    def over(box: np.ndarray, n_cells: int) -> "Grid":
        """`n_cells` cubes along the longest side of a box (2, 3), and a layer more on every side for what leaves it."""
        low, high = box.astype(np.float64)
        length = max(float((high - low).max()) / n_cells, 1e-6)
        shape = np.ceil((high - low) / length - 1e-6).astype(int).clip(1) + 2
        nx, ny, nz = (int(n) for n in shape)
        # A little aside, as walls in the middle of symmetric rooms would run through the centres of cells
        low = (low + high - shape * length) / 2 + np.array(_ASIDE) * length
        return Grid(low.astype(np.float32), length, (nx, ny, nz))

    @property
    def n_cells(self) -> int:
        return int(np.prod(self.shape))

    @property
    def arrays(self) -> GridArrays:
        """For kernels."""
        x, y, z = self.low
        return GridArrays((x, y, z), np.float32(self.length), np.float32(1 / self.length), self.shape)

    @property
    def box(self) -> np.ndarray:
        """Corners of the box whose surfaces may put light into the cells: half a cell more, (2, 3) float32, m."""
        margin = np.float32(self.length / 2)
        return np.stack([self.low - margin, self.low + np.array(self.shape) * np.float32(self.length) + margin])

    def reaches(self, points: np.ndarray) -> np.ndarray:
        """Which points (n, 3) are in the `box`, (n,) bool."""
        low, high = self.box
        return ((points >= low) & (points <= high)).all(axis=1)

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Which points (n, 3) have eight cells around them, (n,) bool."""
        x = (points - self.low) * np.float32(1 / self.length)
        return ((x >= 0.5) & (x < np.array(self.shape) - 0.5)).all(axis=1)

    def centres(self, cells: np.ndarray) -> np.ndarray:
        """Centres of cells (…) as (…, 3) float32, m."""
        index = np.stack(np.unravel_index(cells, self.shape), axis=-1).astype(np.float32)
        return self.low + (index + np.float32(0.5)) * np.float32(self.length)
