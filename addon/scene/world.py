"""The world: light from infinitely far away."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .ray_kinds import RayKind


@dataclass(frozen=True, eq=False)
class World:
    """Radiance that comes from each direction in which nothing is met. Where it is negative it takes light away.

    Attributes
    ----------
    color : (3,) float32, W/(m² sr)
        The radiance where there is no image (below 0 it takes light away); otherwise what the image is multiplied by.
    image : (h, w, 3) float32 or None
        Equirectangular, as Cycles maps it: row 0 looks down (−z), column u looks along the azimuth π − 2πu of x to y.
    hidden_from : set of RayKind
        The rays that do not see it: surfaces do not scatter its light by the lobes that these follow.
    """

    color: np.ndarray
    image: np.ndarray | None = None
    hidden_from: frozenset[RayKind] = frozenset()

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
        return color * np.einsum("ijk,i->k", np.abs(self.image), self.solid_angles, dtype=np.float64)

    @property
    def solid_angles(self) -> np.ndarray:
        """Solid angle of a pixel of each row of the image, (h,) float64, sr."""
        assert self.image is not None
        height, width = self.image.shape[:2]
        return np.diff(-np.cos(np.pi * np.arange(height + 1) / height)) * (2 * np.pi / width)
