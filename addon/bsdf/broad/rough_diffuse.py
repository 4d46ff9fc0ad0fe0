"""Rough diffuse reflection: Oren and Nayar's as Fujii improved it, and light that scatters more than once.

With roughness σ, a = 1/(π + σ (π/2 − 2/3)), b = σ a and t = ωi·ωo − cos θi cos θo, over max(cos θi, cos θo) where it is
positive, the first scattering is f₁ = a + b t (Fujii, "A tiny improvement of Oren-Nayar reflectance model", 2012). Of
its directional albedo E(cos) = π a + b G(cos) and the average Eavg of that,

    f = f₁ + c²/π · Eavg (1 − E(cos θo)) (1 − E(cos θi)) / ((1 − Eavg) (1 − c (1 − Eavg)))

for a colour c (OpenPBR), times the closure's weight, which has that colour too, as in Cycles.
"""

import numpy as np

from ...core.compiling import part
from ...core.sampling.warps import PI, cosine_hemisphere
from ...core.vec3 import ONE, ZERO, dot, mul, times

_SPREAD = np.float32(np.pi / 2 - 2 / 3)
_AVERAGE = np.float32((2 * np.pi - 5.6) / 3)
_TWO_THIRDS, _TINY, _PER_PI = np.float32(2 / 3), np.float32(1e-6), np.float32(1 / np.pi)


@part
def sample(closure, wo, u, v):
    """A cosine-weighted direction, and f |cos| over its density."""
    wi = cosine_hemisphere(u, v)
    return wi, times(evaluate(closure, wo, wi), PI)


@part
def evaluate(closure, wo, wi):
    """The lobe's f in 1/sr, without the cosine; it is reciprocal."""
    a, b = _terms(closure.roughness)
    cos_o, cos_i = max(wo[2], ZERO), max(wi[2], ZERO)
    t = dot(wo, wi) - cos_o * cos_i
    if t > ZERO:
        t /= max(cos_o, cos_i) + _TINY
    lost = (ONE - _single_albedo(a, b, cos_o)) * (ONE - _single_albedo(a, b, cos_i))
    _, missing = _averages(a, b)
    scale = _PER_PI * lost / missing
    more, single = _multiple_scattering(closure.f0, a, b), a + b * t
    return mul(closure.weight, (single + more[0] * scale, single + more[1] * scale, single + more[2] * scale))


@part
def albedo(closure, cos):
    """Directional albedo."""
    a, b = _terms(closure.roughness)
    single = _single_albedo(a, b, cos)
    more = _multiple_scattering(closure.f0, a, b)
    lost = ONE - single
    return mul(closure.weight, (single + more[0] * lost, single + more[1] * lost, single + more[2] * lost))


@part
def _terms(roughness):
    a = ONE / (PI + roughness * _SPREAD)
    return a, roughness * a


@part
def _averages(a, b):
    """Cosine-weighted average of the albedo of the first scattering, and what is missing to 1."""
    average = PI * a + _AVERAGE * b
    return average, max(ONE - average, _TINY)


@part
def _multiple_scattering(color, a, b):
    """Share of the light that the first scattering loses which leaves the surface after all."""
    average, missing = _averages(a, b)
    return (
        color[0] * color[0] * average / (ONE - color[0] * missing),
        color[1] * color[1] * average / (ONE - color[1] * missing),
        color[2] * color[2] * average / (ONE - color[2] * missing),
    )


@part
def _single_albedo(a, b, cos):
    """π a + b G(cos): Fujii's integral of the first scattering."""
    sin = np.sqrt(max(ONE - cos * cos, ZERO))
    rest = _SPREAD - cos
    if cos > _TINY:
        rest = sin * (np.arccos(min(cos, ONE)) - _TWO_THIRDS - sin * cos)
        rest += _TWO_THIRDS * (sin / cos) * (ONE - sin * sin * sin)
    return PI * a + b * rest
