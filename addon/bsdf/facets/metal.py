"""What facets of metal reflect: Fresnel's equations of a complex index of refraction n + ik, and Adobe's F82 curve.

Each is of one colour channel. `edge` is what F82's curve reflects at 82° over what Schlick's does, or a conductor's n.
"""

import numpy as np

from ...core.compiling import part, routine
from ...core.vec3 import ONE, TWO, ZERO
from ...scene.closures import FresnelCurve

CONDUCTOR, F82 = int(FresnelCurve.CONDUCTOR), int(FresnelCurve.F82)

COS_82 = np.float32(1 / 7)
_TINY, _HALF, _ALMOST_ONE = np.float32(1e-20), np.float32(0.5), np.float32(0.999)
_SEVEN = np.float32(7)
_AVERAGE, _OF_EDGE = np.float32(1 / 21), np.float32(1 / 126)


@part
def schlick(cos, f0):
    """f0 + (1 − f0)(1 − cos)⁵."""
    m = max(ONE - cos, ZERO)
    return f0 + (ONE - f0) * (m * m * (m * m) * m)


@part
def f82_factor(f0, at_82):
    """The b of f0 + (1 − f0)(1 − cos)⁵ − b cos (1 − cos)⁶ that makes it `at_82` where cos = 1/7.

    Kutz, Hašan and Edmondson, "Novel Aspects of the Adobe Standard Material", 2021.
    """
    m = ONE - COS_82
    m2 = m * m
    return (schlick(COS_82, f0) - at_82) * _SEVEN / (m2 * m2 * m2)


@part
def f82(cos, f0, at_82):
    """That curve, clipped to [0, 1]."""
    m = max(ONE - cos, ZERO)
    m2 = m * m
    return min(max(schlick(cos, f0) - f82_factor(f0, at_82) * cos * (m2 * m2 * m2), ZERO), ONE)


@part
def f82_average(f0, at_82):
    """Cosine-weighted average of the curve over the hemisphere, not clipped."""
    return f0 + (ONE - f0) * _AVERAGE - f82_factor(f0, at_82) * _OF_EDGE


@part
def extinction(f0, n):
    """The k of a conductor that reflects f0 = ((n − 1)² + k²)/((n + 1)² + k²) at normal incidence."""
    return np.sqrt(max((f0 * (n + ONE) * (n + ONE) - (n - ONE) * (n - ONE)) / max(ONE - f0, _TINY), ZERO))


@part
def index_of(f0, edge):
    """The n that has a reflectance f0 and a tint of the edge: Gulbrandsen, "Artist Friendly Metallic Fresnel", 2014."""
    root = np.sqrt(f0)
    return (ONE - edge) * (ONE + root) / (ONE - root) + edge * (ONE - f0) / (ONE + f0)


@part
def conductor_polarised(cos, n, k):
    """Reflectances (Rs, Rp) of a conductor whose index over that of the near side is n + ik.

    Born and Wolf, Principles of Optics, 14.4.1, with u + iv = √((n + ik)² − sin² θ).
    """
    u, v = refracted(cos, n, k)
    s = ((cos - u) * (cos - u) + v * v) / ((cos + u) * (cos + u) + v * v + _TINY)
    a, b = (n * n - k * k) * cos, TWO * n * k * cos
    p = ((a - u) * (a - u) + (b - v) * (b - v)) / ((a + u) * (a + u) + (b + v) * (b + v) + _TINY)
    return s, p


@part
def refracted(cos, n, k):
    """The u and v of u + iv = √((n + ik)² − sin² θ)."""
    real, imaginary = n * n - k * k - (ONE - cos * cos), TWO * n * k
    size = np.sqrt(real * real + imaginary * imaginary)
    return np.sqrt(max((size + real) * _HALF, ZERO)), np.sqrt(max((size - real) * _HALF, ZERO))


@part
def reflectance(curve, cos, f0, edge):
    """Reflectance of unpolarised light by facets seen at `cos`."""
    if curve == CONDUCTOR:
        s, p = conductor_polarised(cos, edge, extinction(f0, edge))
        return (s + p) * _HALF
    return f82(cos, f0, schlick(COS_82, f0) * edge)


@part
def average(curve, f0, edge):
    """Its cosine-weighted average over the hemisphere.

    As Cycles has it, a conductor's is that of the F82 curve through its values at 0° and 82°.
    """
    if curve == CONDUCTOR:
        return min(max(f82_average(f0, reflectance(curve, COS_82, f0, edge)), ZERO), ONE)
    return f82_average(f0, schlick(COS_82, f0) * edge)


@routine
def reflectances(curve, cos, f0, edge):
    """`reflectance` of three colours."""
    return (
        reflectance(curve, cos, f0[0], edge[0]),
        reflectance(curve, cos, f0[1], edge[1]),
        reflectance(curve, cos, f0[2], edge[2]),
    )


@routine
def averages(curve, f0, edge):
    """`average` of three colours."""
    return average(curve, f0[0], edge[0]), average(curve, f0[1], edge[1]), average(curve, f0[2], edge[2])
