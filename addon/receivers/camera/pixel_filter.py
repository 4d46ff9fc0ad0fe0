"""Where in and around a pixel its samples lie."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

FilterKind = Literal["box", "gaussian", "blackman_harris"]

_TABLE = 1024  # steps of the inverse cumulative distribution


@dataclass(frozen=True)
class PixelFilter:
    """A pixel's filter, by which its samples are distributed, so that the pixel is their plain mean.

    Attributes
    ----------
    kind : str
    width : float
        Pixels, from end to end.
    """

    kind: FilterKind = "blackman_harris"
    width: float = 1.5

    def offsets(self, u: np.ndarray) -> np.ndarray:
        """Places relative to the pixel's middle, pixels, for numbers in [0, 1) of the same shape.

        The filter is the product of f(x) f(y), with f as Cycles has it: the Gaussian e^(−2(6x/width)²), and
        Blackman-Harris with four terms.
        """
        x = (np.linspace(0, 1, _TABLE + 1) - 0.5) * self.width
        middles = (x[1:] + x[:-1]) / 2
        cumulative = np.concatenate([[0], np.cumsum(self._density(middles))])
        return np.interp(u, cumulative / cumulative[-1], x)

    def _density(self, x: np.ndarray) -> np.ndarray:
        """f, not normalised."""
        if self.kind == "box":
            return np.ones_like(x)
        if self.kind == "gaussian":
            return np.exp(-2 * (6 * x / self.width) ** 2)
        angle = 2 * np.pi * (x / self.width + 0.5)
        weights = (0.35875, -0.48829, 0.14128, -0.01168)
        return np.sum([w * np.cos(k * angle) for k, w in enumerate(weights)], axis=0)
