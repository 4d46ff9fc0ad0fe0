"""The world: light from infinitely far away."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class World:
    """Radiance that comes from each direction in which nothing is met.

    Attributes
    ----------
    color : (3,) float32, W/(m² sr)
        The radiance where there is no image; otherwise what the image is multiplied by.
    image : (h, w, 3) float32 or None
        Equirectangular, as Cycles maps it: row 0 looks down (−z), column u looks along the azimuth π − 2πu of x to y.
    """

    color: np.ndarray
    image: np.ndarray | None = None

    @staticmethod
    def constant(color: np.ndarray | float) -> "World":
        """The same radiance, (3,) or a number, from everywhere."""
        return World(np.broadcast_to(np.asarray(color, np.float32), (3,)).copy())

    @property
    def black(self) -> bool:
        return not (self.color > 0).any()

    def radiance(self, directions: np.ndarray) -> np.ndarray:
        """Radiance from unit directions (n, 3), (n, 3) or (1, 3) float32."""
        if self.image is None:
            return self.color[None]
        height, width = self.image.shape[:2]
        u = np.float32(0.5) - np.arctan2(directions[:, 1], directions[:, 0]) / np.float32(2 * np.pi)
        v = np.arccos(np.clip(-directions[:, 2], -1, 1)) / np.float32(np.pi)
        x = np.minimum((u * width).astype(np.int32), width - 1)
        y = np.minimum((v * height).astype(np.int32), height - 1)
        return self.color * self.image[y, x]
