"""The world: light from infinitely far away."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..core.sampling.cutpoint_table import Inversion
from ..core.sampling.vectors import rows
from ..core.sampling.warps import pdf_uniform_sphere, sample_uniform_sphere

_TWO_PI = np.float32(2 * np.pi)


@dataclass(frozen=True)
class World:
    """Radiance that comes from each direction in which nothing is met. Where it is negative it takes light away.

    Attributes
    ----------
    color : (3,) float32, W/(m² sr)
        The radiance where there is no image (below 0 it takes light away); otherwise what the image is multiplied by.
    image : (h, w, 3) float32 or None
        Equirectangular, as Cycles maps it: row 0 looks down (−z), column u looks along the azimuth π − 2πu of x to y.
    """

    color: np.ndarray
    image: np.ndarray | None = None

    @staticmethod
    def constant(color: np.ndarray | float) -> "World":
        """The same radiance, (3,) or a number, from everywhere."""
        return World(np.broadcast_to(np.asarray(color, np.float32), (3,)).copy())

    @cached_property
    def black(self) -> bool:
        return not (self.integral != 0).any()

    @cached_property
    def integral(self) -> np.ndarray:
        """∫ |L| dω over all directions, (3,) float64, W/m²."""
        color = np.abs(self.color).astype(np.float64)
        if self.image is None:
            return color * 4 * np.pi
        height, width = self.image.shape[:2]
        return color * np.einsum("ijk,i->k", np.abs(self.image), _solid_angles(height, width), dtype=np.float64)

    def radiance(self, directions: np.ndarray) -> np.ndarray:
        """Radiance from unit directions (n, 3), (n, 3) or (1, 3) float32."""
        if self.image is None:
            return self.color[None]
        return self.color * rows(self.image.reshape(-1, 3), self._pixel(directions))

    def sample(self, u: np.ndarray) -> np.ndarray:
        """Unit directions (n, 3) for points `u` (n, 2) of the unit square, more where the world is bright; see `pdf`.

        A row of pixels, then a pixel in it, then a direction uniform by solid angle within the pixel.
        """
        if self.image is None:
            return sample_uniform_sphere(u)
        height, width = self.image.shape[:2]
        of_rows, of_columns, _ = self._distribution
        row, within_row = of_rows.invert(0, u[:, 0])
        column, within_column = of_columns.invert(row, u[:, 1])
        edges = _heights(height)
        z = (edges[row] + within_row * (edges[row + 1] - edges[row])).astype(np.float32)
        azimuth = np.float32(np.pi) - _TWO_PI * ((column + within_column) / width).astype(np.float32)
        r = np.sqrt(np.maximum(1 - z * z, 0))
        return np.stack([r * np.cos(azimuth), r * np.sin(azimuth), z], axis=1)

    def pdf(self, directions: np.ndarray) -> np.ndarray:
        """Density of `sample` by solid angle, proportional to the mean of |L| over a pixel's colours, (n,) float32."""
        if self.image is None:
            return np.full(len(directions), pdf_uniform_sphere(), np.float32)
        return self._distribution[2].take(self._pixel(directions))

    def _pixel(self, directions: np.ndarray) -> np.ndarray:
        """Number of the pixel that unit directions look at, row by row."""
        assert self.image is not None
        height, width = self.image.shape[:2]
        u = np.float32(0.5) - np.arctan2(directions[:, 1], directions[:, 0]) / _TWO_PI
        v = np.arccos(np.clip(-directions[:, 2], -1, 1)) / np.float32(np.pi)
        row, column = (v * height).astype(np.int32), (u * width).astype(np.int32)
        return np.minimum(row, height - 1) * width + np.minimum(column, width - 1)

    @cached_property
    def _distribution(self) -> tuple[Inversion, Inversion, np.ndarray]:
        """Choice of a row and of a pixel in each row, and densities (h, w), 1/sr."""
        assert self.image is not None
        height, width = self.image.shape[:2]
        brightness = (np.abs(self.image) @ (np.abs(self.color) / 3)).astype(np.float64)
        weight = brightness * _solid_angles(height, width)[:, None]
        of_row = weight.sum(axis=1)
        columns = np.cumsum(weight, axis=1) / np.maximum(of_row, 1e-300)[:, None]
        columns[:, -1] = 1
        chances = np.cumsum(of_row) / max(of_row.sum(), 1e-300)
        density = (brightness / max(of_row.sum(), 1e-300)).astype(np.float32)
        return Inversion(chances[None]), Inversion(columns), density


def _heights(n_rows: int) -> np.ndarray:
    """Heights z of the edges of an equirectangular image's rows, (n_rows + 1,) float64."""
    return -np.cos(np.pi * np.arange(n_rows + 1) / n_rows)


def _solid_angles(n_rows: int, n_columns: int) -> np.ndarray:
    """Solid angle of a pixel of each row, (n_rows,) float64, sr."""
    return np.diff(_heights(n_rows)) * (2 * np.pi / n_columns)
