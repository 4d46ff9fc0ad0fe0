"""Henyey and Greenstein's phase function, p(cos θ) = (1 − g²) / (4π (1 + g² − 2 g cos θ)^(3/2)) by solid angle."""

import numpy as np

from ..core.compiling import part
from ..core.sampling.warps import at_versine
from ..core.vec3 import ONE, TWO, to_world

_ISOTROPIC = np.float32(1e-3)
_PER_SPHERE = np.float32(1 / (4 * np.pi))


@part
def density(cos, g):
    """The density p, of the cosine between the directions before and after a scattering, 1/sr."""
    if abs(g) < _ISOTROPIC:
        return _PER_SPHERE
    spread = ONE + g * g - TWO * g * cos
    return _PER_SPHERE * (ONE - g * g) / (spread * np.sqrt(spread))


@part
def sample(direction, g, u, v):
    """The direction after a scattering; its density is p."""
    if abs(g) < _ISOTROPIC:
        versine = TWO * u
    else:
        k = (ONE - g * g) / (ONE - g + TWO * g * u)
        versine = min(max(ONE - (ONE + g * g - k * k) / (TWO * g), np.float32(0)), TWO)
    return to_world(at_versine(versine, v), direction)
