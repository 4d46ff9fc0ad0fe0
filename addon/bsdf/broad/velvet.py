"""Velvet: facets whose normals lie around the horizon, f = D G/(4 cos θi cos θo); reciprocal.

D(h) = exp(−cot²θ/σ²)/(π σ² sin⁴θ) and G = min(1, 2 (n·h)(n·ωo)/(ωo·h), 2 (n·h)(n·ωi)/(ωo·h)): Ashikhmin, Premoze and
Shirley, "A Microfacet-Based BRDF Generator", 2000, without its even part. The roughness is σ.
"""

from pathlib import Path

import numpy as np

from ...core.compiling import part
from ...core.sampling.warps import TWO_PI, cosine_uniform_mixture
from ...core.vec3 import BLACK, ONE, TWO, ZERO, dot, normalized, plus, times
from ..albedo_tables import interpolate_2

FILE = Path(__file__).with_suffix(".npz")
FILE_DIGEST = "1343a3372121b6908299541d9a12346a9b9ebaac42e2b7b981a9834114191130"
"""SHA-256 of the file, which `tools/velvet_table.py` makes. Kernels contain the table; see `albedo_tables`."""

with np.load(FILE) as tables:
    ALBEDO = tables["albedo"]
"""Directional albedo at even nodes of the roughness and of the cosine, both from 0 to 1."""

_LEAST_ROUGHNESS, _LEAST = np.float32(0.01), np.float32(1e-5)
_HALF, _QUARTER, _PER_PI = np.float32(0.5), np.float32(0.25), np.float32(1 / np.pi)


@part
def sample(closure, wo, u, v):
    """A direction halfway between cosine-weighted and uniform, and f |cos| over its density."""
    wi = cosine_uniform_mixture(u, v)
    return wi, times(evaluate(closure, wo, wi), wi[2] * TWO_PI / (wi[2] + _HALF))


@part
def evaluate(closure, wo, wi):
    """The lobe's f in 1/sr, without the cosine."""
    if wo[2] <= ZERO or wi[2] <= ZERO:
        return BLACK
    return times(closure.weight, shape(max(closure.roughness, _LEAST_ROUGHNESS), wo, wi))


@part
def shape(sigma, wo, wi):
    """Value of a white lobe, 1/sr."""
    h = normalized(plus(wo, wi))
    cos_h, cos_o = abs(h[2]), abs(dot(wo, h))
    if cos_h >= ONE - _LEAST or cos_o <= _LEAST:
        return ZERO
    twice = TWO * max(cos_h / cos_o, _LEAST)
    shadowing = min(ONE, min(twice * wo[2], twice * wi[2]))
    sin2 = ONE - cos_h * cos_h
    per_sigma2 = ONE / (sigma * sigma)
    distribution = np.exp(-cos_h * cos_h / sin2 * per_sigma2) * per_sigma2 * _PER_PI / (sin2 * sin2)
    return _QUARTER * distribution * shadowing / (wo[2] * wi[2])


@part
def albedo(closure, cos):
    """Directional albedo."""
    return times(closure.weight, interpolate_2(ALBEDO, closure.roughness, cos))
