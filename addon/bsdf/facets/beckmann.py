"""Beckmann: facets whose slopes are a normal distribution with the variance α²/2."""

from math import erf

import numpy as np

from ...core.compiling import part, routine
from ...core.sampling.warps import PI
from ...core.vec3 import ONE, TWO, ZERO, normalized

_HALF, _QUARTER, _ROOT_PI = np.float32(0.5), np.float32(0.25), np.float32(np.pi**0.5)
_FLAT, _BELOW_ONE = np.float32(1e-5), np.float32(1 - 2**-24)
_UNMASKED = np.float32(0.39)  # (α tan θ)² below which the fit is 0
_OVER = np.float32(-1.259), np.float32(0.396)
_UNDER = np.float32(3.535), np.float32(2.181)
_N_STEPS = 5  # of Newton's method; it has converged after three or four
_CENTRE = tuple(
    np.float32(c)
    for c in (
        *(2.81022636e-08, 3.43273939e-07, -3.5233877e-06, -4.39150654e-06, 0.00021858087),
        *(-0.00125372503, -0.00417768164, 0.246640727, 1.50140941),
    )
)
_TAIL = tuple(
    np.float32(c)
    for c in (
        *(-0.000200214257, 0.000100950558, 0.00134934322, -0.00367342844, 0.00573950773),
        *(-0.0076224613, 0.00943887047, 1.00167406, 2.83297682),
    )
)
_CENTRE_ENDS, _CENTRE_AT, _TAIL_AT = np.float32(5), np.float32(2.5), np.float32(3)


@part
def distribution(h, alpha_x, alpha_y):
    """Microfacet normals h an area and solid angle, D(h), in 1/sr: Walter et al. 2007, equation 25."""
    x, y, cos2 = h[0] / alpha_x, h[1] / alpha_y, max(h[2] * h[2], _FLAT)
    return np.exp(-(x * x + y * y) / cos2) / (PI * alpha_x * alpha_y * cos2 * cos2)


@part
def one_plus_lambda(slope2):
    """1 + Λ of directions with the squared slope (α tan θ)²: the fit of Heitz 2014, below equation 69.

    Cycles takes it, too; it is within 0.4 % of the error functions that it stands for.
    """
    if slope2 < _UNMASKED:
        return ONE
    a = ONE / np.sqrt(slope2)
    return ONE + (ONE + a * (_OVER[0] + a * _OVER[1])) / (a * (_UNDER[0] + a * _UNDER[1]))


@routine
def visible_normal(wo, alpha_x, alpha_y, u, v):
    """The normal of a facet that is seen from wo: density G₁(wo) D(h) (wo·h)/wo.z.

    Heitz and d'Eon, "Importance Sampling Microfacet-Based BSDFs using the Distribution of Visible Normals", 2014:
    stretched so that α is 1, slopes across the view are normal, and those along it are normal times the facet's share
    of the view.
    """
    x, y, z = normalized((alpha_x * wo[0], alpha_y * wo[1], wo[2]))
    sin = np.sqrt(x * x + y * y)
    across = inverse_erf(TWO * v - ONE)
    if sin <= _FLAT:
        along = inverse_erf(TWO * u - ONE)
        return normalized((alpha_x * along, alpha_y * across, ONE))
    along, cos_phi, sin_phi = -_slope_along(z / sin, u), x / sin, y / sin
    slope_x, slope_y = cos_phi * along - sin_phi * across, sin_phi * along + cos_phi * across
    return normalized((alpha_x * slope_x, alpha_y * slope_y, ONE))


@part
def _slope_along(cot, u):
    """A slope t away from a view at the cotangent `cot`, with a density as exp(−t²)(1 − t/cot) below cot.

    With b = erf t and K = 1/(cot √π) the distribution function is as C(b) = 1 + b + K exp(−t²), whose derivative is
    1 − t/cot: it falls, so that Newton's method comes to the root from below whatever it starts from. It starts where
    the root is with exp(−t²) ≈ 1 − b² (Jakob, "An Improved Visible Normal Sampling Routine for the Beckmann
    Distribution", 2014).
    """
    end, k = np.float32(erf(cot)), ONE / (cot * _ROOT_PI)
    level = u * (ONE + end + k * np.exp(-cot * cot))
    nearly = k - u * (ONE + end + k * (ONE - end * end)) + ONE
    b = -nearly / (_HALF + np.sqrt(k * nearly + _QUARTER))
    t = inverse_erf(b)
    for _ in range(_N_STEPS):
        slope = ONE - t / cot
        if slope <= ZERO:
            break
        b = max(b - (ONE + b + k * np.exp(-t * t) - level) / slope, -_BELOW_ONE)
        t = inverse_erf(min(b, end))
    return min(t, cot)


@part
def inverse_erf(y):
    """The inverse of the error function: Giles, "Approximating the erfinv Function", 2010."""
    y = min(max(y, -_BELOW_ONE), _BELOW_ONE)
    w = -np.log((ONE - y) * (ONE + y))
    if w < _CENTRE_ENDS:
        return y * _polynomial(_CENTRE, w - _CENTRE_AT)
    return y * _polynomial(_TAIL, np.sqrt(w) - _TAIL_AT)


@part
def _polynomial(c, x):
    """Nine coefficients, from the highest power."""
    high = (((c[0] * x + c[1]) * x + c[2]) * x + c[3]) * x + c[4]
    return (((high * x + c[5]) * x + c[6]) * x + c[7]) * x + c[8]
