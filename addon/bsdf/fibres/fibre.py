"""Fibres: what hair does to light, to all sides around it, in a frame whose +x is along the strand.

Chiang et al. 2016 (as pbrt and Cycles have it): light is reflected (R), passes (TT), is reflected inside once (TRT) or
more often. θ is the angle to the plane across the strand, φ goes around it, h in [−1, 1] is where across its width
light meets it. A strand is far thinner than what its light is wanted for, so that h is drawn and not known:

    f = ½ ∫ Σ_p M_p(θ_o, θ_i) A_p(h, θ_o) N_p(h, φ) dh

o is the view and i the light. A strand of a width D shows D cos θ to a ray, and f has no cosine of its own: what comes
to the view is ∫ f L dω_i. It is not reciprocal, for as much light comes to a view from a photon as

    f(o, i) cos θ_o / cos θ_i

says, which is how photons are scattered, with A and N by the angle of the view, to which they fly.

There are more models: Cycles' Hair BSDF, a Cauchy distribution about the cone of mirrored directions, and the
translucent side of a strand.
"""

import numpy as np

from ...core.compiling import part, routine
from ...core.sampling.warps import TWO_PI, cosine_hemisphere
from ...core.vec3 import BLACK, ONE, TWO, ZERO, mean, mul, negative, times
from ...scene.closures import FibreModel
from ..fresnel import fresnel_dielectric

_CHIANG, _REFLECTION = int(FibreModel.CHIANG), int(FibreModel.REFLECTION)
_TRANSLUCENT = int(FibreModel.TRANSLUCENT)
_PI, _HALF, _FOUR, _QUARTER = np.float32(np.pi), np.float32(0.5), np.float32(4), np.float32(0.25)
_HALF_PI = np.float32(np.pi / 2)
_LOW_BITS = np.float32(4096)
_TINY, _LEAST = np.float32(1e-7), np.float32(1e-5)
_LEAST_VARIANCE, _NOTHING, _MOST = np.float32(1e-6), np.float32(1e-20), np.float32(16)


@routine
def sample(closure, wo, choice, u, v, from_light):
    """A direction of a strand, and f over its density."""
    if closure.distribution == _TRANSLUCENT:
        return negative(cosine_hemisphere(u, v)), closure.weight
    if closure.distribution == _CHIANG:
        return _chiang(closure, wo, choice, u, v, from_light)
    return _kajiya(closure, wo, u, v, from_light)


@part
def _chiang(closure, wo, choice, u, v, from_light):
    """One of the ways through a strand, by what is left along each."""
    sin_o = min(max(wo[0], -ONE), ONE)
    cos_o = np.sqrt(max(ONE - sin_o * sin_o, ZERO))
    h, around = TWO * u - ONE, _low_bits(v)
    turn, left = _ways(closure, sin_o, cos_o, h)
    p = _chosen(left, choice)
    weight = times(_way(left, p), _inverse_chance(left, p))
    tilt, variance = _lobe(closure, p)
    if from_light:  # what tilts the view's angle tilts the other way for the light's
        sin_t, cos_t = _longitudinal(sin_o, cos_o, variance, _low_bits(choice), _low_bits(u))
        sin_i, cos_i = _tilted(sin_t, cos_t, -tilt)
        turn, of_view = _ways(closure, sin_i, cos_i, h)
        weight = times(_way(of_view, p), _inverse_chance(left, p) * _adjoint(cos_i, cos_o) * _adjoint(cos_i, cos_t))
    else:
        sin_t, cos_t = _tilted(sin_o, cos_o, tilt)
        sin_i, cos_i = _longitudinal(sin_t, cos_t, variance, _low_bits(choice), _low_bits(u))
    phi = TWO_PI * around
    if p < 3:
        gamma_o = np.arcsin(h)
        phi = TWO * np.float32(p) * turn - TWO * gamma_o + np.float32(p) * _PI + _logistic(closure.f90[0], v)
    return _direction(wo, sin_i, cos_i, phi), mul(closure.weight, weight)


@part
def _ways(closure, sin_o, cos_o, h):
    """The azimuth of the refracted ray, and what light is left along R, TT, TRT and all others."""
    ior = closure.ior
    cos_inside = np.sqrt(ONE - (sin_o / ior) * (sin_o / ior))
    bent = np.sqrt(max(ior * ior - sin_o * sin_o, _TINY)) / max(cos_o, _LEAST)
    sin_t = min(max(h / bent, -ONE), ONE)
    way = TWO * np.sqrt(ONE - sin_t * sin_t) / max(cos_inside, _LEAST)
    passes = np.exp(-closure.f0[0] * way), np.exp(-closure.f0[1] * way), np.exp(-closure.f0[2] * way)
    f = fresnel_dielectric(cos_o * np.sqrt(max(ONE - h * h, ZERO)), ior)
    tt = times(passes, (ONE - f) * (ONE - f))
    trt = times(mul(tt, passes), f)
    inside = times(passes, f)
    rest = (
        trt[0] * inside[0] / max(ONE - inside[0], _TINY),
        trt[1] * inside[1] / max(ONE - inside[1], _TINY),
        trt[2] * inside[2] / max(ONE - inside[2], _TINY),
    )
    return np.arcsin(sin_t), ((f, f, f), tt, trt, rest)


@part
def _chosen(left, choice):
    """One of the ways, by what is left along each."""
    r, tt, trt = mean(left[0]), mean(left[1]), mean(left[2])
    at = choice * (r + tt + trt + mean(left[3]))
    if at < r:
        return 0
    if at < r + tt:
        return 1
    return 2 if at < r + tt + trt else 3


@part
def _way(left, p):
    """What is left along a way."""
    r, tt, trt, rest = left
    if p == 0:
        return r
    if p == 1:
        return tt
    return trt if p == 2 else rest


@part
def _inverse_chance(left, p):
    """1 over the probability of a way that was chosen."""
    total = mean(left[0]) + mean(left[1]) + mean(left[2]) + mean(left[3])
    return total / max(mean(_way(left, p)), _NOTHING)


@part
def _adjoint(cos_view, cos_light):
    """What a photon's weight is multiplied by, since strands show less of themselves along them."""
    return min(cos_view / max(cos_light, _TINY), _MOST)


@part
def _lobe(closure, p):
    """By how much cuticles tilt a way's angle, and the variance about it; R's is narrower under a coat."""
    tilt, variance = closure.f90[1], closure.roughness
    if p == 0:
        return -TWO * tilt, max(closure.f90[2], _LEAST_VARIANCE)
    if p == 1:
        return tilt, max(_QUARTER * variance, _LEAST_VARIANCE)
    return (_FOUR * tilt if p == 2 else ZERO), max(_FOUR * variance, _LEAST_VARIANCE)


@part
def _tilted(sin, cos, tilt):
    """An angle and another one together; its cosine is above 0."""
    a, b = np.sin(tilt), np.cos(tilt)
    return sin * b + cos * a, abs(cos * b - sin * a)


@part
def _longitudinal(sin_o, cos_o, variance, u, v):
    """Sine and cosine of an angle about the mirrored one (d'Eon et al. 2013)."""
    u = max(u, _LEAST)
    cos = ONE + variance * np.log(u + (ONE - u) * np.exp(-TWO / variance))
    sin = np.sqrt(max(ONE - cos * cos, ZERO))
    sin_i = -cos * sin_o + sin * np.cos(TWO_PI * v) * cos_o
    sin_i = min(max(sin_i, -ONE), ONE)
    return sin_i, np.sqrt(max(ONE - sin_i * sin_i, ZERO))


@part
def _logistic(s, u):
    """A number in [−π, π] of the logistic distribution of a scale."""
    low = ONE / (ONE + np.exp(_PI / s))
    share = min(max(low + u * (ONE - TWO * low), _TINY), ONE - _TINY)
    x = -s * np.log(ONE / share - ONE)
    return min(max(x, -_PI), _PI)


@part
def _kajiya(closure, wo, u, v, from_light):
    """Cycles' Hair BSDF: about the cone of mirrored directions, on the view's side or on the other."""
    roughness, spread, offset = closure.roughness, max(closure.f90[0], _LEAST), closure.f90[1]
    theta_o = np.arcsin(min(max(wo[0], -ONE), ONE))
    low, high = _bounds(theta_o, roughness, offset)
    theta = TWO * (np.tan(low + u * (high - low)) * roughness + offset) - theta_o
    if closure.distribution == _REFLECTION:
        phi = TWO * np.arcsin(ONE - TWO * v) * spread
    else:
        phi = _PI + spread * np.tan((v - _HALF) * TWO * np.arctan(_HALF_PI / spread))
    if abs(theta) >= _HALF_PI:
        return wo, BLACK
    weight = closure.weight
    if from_light:
        ratio, (least, most) = _adjoint(np.cos(theta), np.cos(theta_o)), _bounds(theta, roughness, offset)
        weight = times(weight, min(ratio * ratio * (high - low) / max(most - least, _TINY), _MOST))
    return _direction(wo, np.sin(theta), np.cos(theta), phi), weight


@part
def lamplight_share(closure, view, light):
    """What of lamplight on a sampled way shadow rays find, as Cycles evaluates its Hair BSDF.

    It wants the normal where the view meets a strand on the light's side, or for transmission on the other: at an
    azimuth φ that is so across (1 ± cos φ)/2 of the strand's width. It reflects none by more than a quarter turn.
    """
    if closure.distribution in (_CHIANG, _TRANSLUCENT):
        return ONE
    across = view[1] * view[1] + view[2] * view[2], light[1] * light[1] + light[2] * light[2]
    cos = (view[1] * light[1] + view[2] * light[2]) / max(np.sqrt(across[0] * across[1]), _TINY)
    if closure.distribution == _REFLECTION:
        return _HALF + _HALF * cos if cos > ZERO else ZERO
    return _HALF - _HALF * cos


@part
def _bounds(theta, roughness, offset):
    """Between which angles the Cauchy distribution of half the way to the light is cut, seen from an angle."""
    low = np.arctan(((theta - _HALF_PI) * _HALF - offset) / roughness)
    return low, np.arctan(((theta + _HALF_PI) * _HALF - offset) / roughness)


@part
def _direction(wo, sin, cos, phi):
    """The direction of an angle to the plane across the strand that is turned about it by φ from another one's."""
    size = np.sqrt(wo[1] * wo[1] + wo[2] * wo[2])
    y, z = (wo[1] / size, wo[2] / size) if size > _TINY else (ZERO, ONE)
    a, b = np.cos(phi), np.sin(phi)
    return sin, cos * (y * a - z * b), cos * (z * a + y * b)


@part
def _low_bits(u):
    """Another number in [0, 1): the lower half of the bits of one that is."""
    return u * _LOW_BITS - np.floor(u * _LOW_BITS)
