"""Phase functions: Henyey and Greenstein's, and any others as tables of equally probable rings.

p(cos θ) = (1 − g²) / (4π (1 + g² − 2 g cos θ)^(3/2)), and for n rings between versines v = 1 − cos θ of a table,
p = 1 / (2π n (vᵢ₊₁ − vᵢ)); densities by solid angle.
"""

import numpy as np

from ...core.compiling import part, routine
from ...core.sampling.warps import at_versine
from ...core.vec3 import ONE, TWO, to_world

N_RINGS = 4096

_ISOTROPIC = np.float32(1e-3)
_PER_SPHERE = np.float32(1 / (4 * np.pi))
_PER_RING = np.float32(1 / (2 * np.pi * N_RINGS))
_NARROWEST = np.float32(2**-24)  # a ring by its versines: what a cosine by float32 can tell


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


@routine
def density_of_rings(cos, rings, k):
    """The density by the k-th of tables of rings (m, N_RINGS + 1)."""
    versine, low, high = ONE - cos, 0, N_RINGS
    while high - low > 1:
        middle = (low + high) // 2
        if rings[k, middle] <= versine:
            low = middle
        else:
            high = middle
    return _PER_RING / max(rings[k, low + 1] - rings[k, low], _NARROWEST)


@routine
def sample_rings(direction, rings, k, u, v):
    """The direction after a scattering by the k-th of tables of rings."""
    place = u * np.float32(N_RINGS)
    ring = min(int(place), N_RINGS - 1)
    across = place - np.float32(ring)
    versine = rings[k, ring] + across * (rings[k, ring + 1] - rings[k, ring])
    return to_world(at_versine(versine, v), direction)
