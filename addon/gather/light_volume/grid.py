"""A grid of cubes over a box, and how points find their cells."""

from dataclasses import dataclass

import numpy as np

_ASIDE = (0.137, 0.071, 0.193)  # cells along x, y and z

CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], np.int32)
"""The eight corners of a unit cube."""


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
        x = self._coordinates(points)
        return ((x >= 0.5) & (x < np.array(self.shape) - 0.5)).all(axis=1)

    def cells(self, points: np.ndarray) -> np.ndarray:
        """The cell of each point (n, 3), counted along z first: (n,) int64; `n_cells` outside the grid."""
        return self._number(np.floor(self._coordinates(points)).astype(np.int32))

    def around(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The eight cells whose centres surround each point; those nearest to it, for points outside the grid.

        Returns
        -------
        cells : (n, 8) int64
        weights : (n, 8) float32
            Of trilinear interpolation between the centres.
        """
        x = self._coordinates(points) - np.float32(0.5)
        first = np.clip(np.floor(x).astype(np.int32), 0, np.array(self.shape, np.int32) - 2)
        along = np.clip(x - first, 0, 1).astype(np.float32)[:, None]
        weights = np.where(CORNERS == 1, along, 1 - along).prod(axis=2)
        return self._number((first[:, None] + CORNERS).reshape(-1, 3)).reshape(-1, 8), weights

    def centres(self, cells: np.ndarray) -> np.ndarray:
        """Centres of cells (…) as (…, 3) float32, m."""
        index = np.stack(np.unravel_index(cells, self.shape), axis=-1).astype(np.float32)
        return self.low + (index + np.float32(0.5)) * np.float32(self.length)

    def _coordinates(self, points: np.ndarray) -> np.ndarray:
        """Points in cells from the lowest corner, (n, 3) float32."""
        return (points - self.low) * np.float32(1 / self.length)

    def _number(self, index: np.ndarray) -> np.ndarray:
        nx, ny, nz = self.shape
        x, y, z = index.T.astype(np.int64)
        inside = (x >= 0) & (x < nx) & (y >= 0) & (y < ny) & (z >= 0) & (z < nz)
        return np.where(inside, (x * ny + y) * nz + z, self.n_cells)
