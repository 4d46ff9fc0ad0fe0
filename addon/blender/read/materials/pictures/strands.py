"""Hair Info: a strand's random number and the share of its length before a point, as a picture over the two."""

import numpy as np

from .texture_grid import Coordinates, Picture

ON_STRANDS = ".strands"
"""The UV map that hair has of them."""

_N = 64  # texels a side


def picture_of_strands() -> Picture:
    """Random in the first channel, Intercept in the second."""
    at = (np.arange(_N, dtype=np.float32) + np.float32(0.5)) / _N
    pixels = np.ones((_N, _N, 4), np.float32)
    pixels[..., 0], pixels[..., 1] = at, at[:, None]
    return Picture(pixels, "EXTEND", Coordinates(ON_STRANDS))
