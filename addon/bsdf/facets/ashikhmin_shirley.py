"""Ashikhmin and Shirley, "An Anisotropic Phong BRDF Model", 2000, without its Fresnel factor, as Cycles has it.

Facets are a power of their cosine, D(h) = √((n_x + 1)(n_y + 1))/(2π) cosᵉ θ with e = n_x cos² φ + n_y sin² φ, sampled
whether they are seen or not; f = D/(4 (h·o) max(cos o, cos i)). The exponents are 2/α² − 2.
"""

import numpy as np

from ...core.compiling import part, routine
from ...core.sampling.warps import TWO_PI
from ...core.vec3 import ONE, TWO, ZERO

_SHARPEST, _TINY, _HALF, _BELOW_ONE = np.float32(1e-4), np.float32(1e-20), np.float32(0.5), np.float32(1 - 2**-24)


@part
def exponent(alpha):
    """The power n that stands for a width α."""
    alpha = max(alpha, _SHARPEST)
    return TWO / (alpha * alpha) - TWO


@routine
def distribution(h, alpha_x, alpha_y):
    """Microfacet normals h a solid angle, in 1/sr; their integral over the hemisphere is 1."""
    x, y, sin2 = exponent(alpha_x), exponent(alpha_y), min(h[0] * h[0] + h[1] * h[1], _BELOW_ONE)
    norm = np.sqrt((x + ONE) * (y + ONE)) / TWO_PI
    e = (x * h[0] * h[0] + y * h[1] * h[1]) / max(sin2, _TINY)
    return norm * np.exp(_HALF * e * np.log1p(-sin2))


@routine
def normal(alpha_x, alpha_y, u, v):
    """A facet's normal with that density: equations 9 and 10, all around at once."""
    x, y, phi = exponent(alpha_x), exponent(alpha_y), TWO_PI * u
    cos_phi, sin_phi = np.sqrt(y + ONE) * np.cos(phi), np.sqrt(x + ONE) * np.sin(phi)
    scale = ONE / np.sqrt(cos_phi * cos_phi + sin_phi * sin_phi)
    cos_phi, sin_phi = cos_phi * scale, sin_phi * scale
    e = x * cos_phi * cos_phi + y * sin_phi * sin_phi
    below = -np.expm1(np.log(max(v, _TINY)) / (e + ONE))  # 1 − cos θ, which keeps its digits
    r = np.sqrt(max(below * (TWO - below), ZERO))
    return r * cos_phi, r * sin_phi, ONE - below
