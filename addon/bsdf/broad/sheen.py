"""Sheen of a layer of microfibres: a cosine lobe transformed linearly, fitted to volumes of fibres.

Zeltner, Burley and Chiang, "Practical Multiple-Scattering Sheen Using Linearly Transformed Cosines", 2022. Of the light
that goes to a view at `cos` to the normal, a share of the albedo R(cos) comes with the density

    D(ω) = z/π · (a/l²)²,   l² = (a x + b z)² + (a y)² + z²,

where x is the coordinate of ω along the view's tangent; a and b depend on the roughness and on cos. They and R are
rational functions fitted to the tables of the paper's authors (b is MaterialX's fit, the others are of its form), R to
1 % of its mean over directions from roughness 0.15 on. f0 is the colour. The lobe is not reciprocal.
"""

import numpy as np

from ...core.compiling import part
from ...core.sampling.warps import TWO_PI, cosine_hemisphere, cosine_uniform_mixture
from ...core.vec3 import BLACK, ONE, ZERO, largest, mul, normalized, times

_LEAST_ROUGHNESS = np.float32(0.07)  # below there is next to no sheen
_HALF, _TINY, _PER_PI = np.float32(0.5), np.float32(1e-7), np.float32(1 / np.pi)
_PER_ROOT_2_PI = np.float32(1 / np.sqrt(2 * np.pi))
_A = np.float32(3.025949), np.float32(0.79633), np.float32(0.337281), np.float32(3.12349)
_B = np.float32(2.54053e-5), np.float32(1.71228), np.float32(-1.71506), np.float32(1.34174)
_WIDTH = np.float32(0.131132), np.float32(1.364419), np.float32(0.190538), np.float32(0.954527)
_MEAN = np.float32(-0.087371), np.float32(-1.68095), np.float32(2.537091), np.float32(-1.257748), np.float32(0.03)
_OFFSET = np.float32(0.003814), np.float32(-0.028188), np.float32(0.094058), np.float32(1.291162), np.float32(-2.045005)


@part
def sample(closure, wo, u, v, from_light):
    """A direction, and f |cos| over its density: of a path by the lobe itself, of a photon halfway to uniform."""
    if from_light:
        wi = cosine_uniform_mixture(u, v)
        return wi, times(evaluate(closure, wi, wo), wi[2] * TWO_PI / (wi[2] + _HALF))
    a, b = _transform(closure, wo[2])
    x, y, z = cosine_hemisphere(u, v)
    x, y, z = normalized((x - z * b, y, z * a))
    tangent = _tangent(wo)
    return (x * tangent[0] - y * tangent[1], x * tangent[1] + y * tangent[0], z), albedo(closure, wo[2])


@part
def evaluate(closure, view, light):
    """The lobe's f in 1/sr, without the cosine."""
    if view[2] <= ZERO or light[2] <= ZERO:
        return BLACK
    a, b = _transform(closure, view[2])
    tangent = _tangent(view)
    x = light[0] * tangent[0] + light[1] * tangent[1]
    y = light[1] * tangent[0] - light[0] * tangent[1]
    along, across = a * x + b * light[2], a * y
    ratio = a / (along * along + across * across + light[2] * light[2])
    return times(albedo(closure, view[2]), ratio * ratio * _PER_PI)


@part
def albedo(closure, cos):
    """Directional albedo, seen at `cos`."""
    return times(mul(closure.weight, closure.f0), share(closure.roughness, cos))


@part
def transmittance(closure, cos):
    """Share of the light that it leaves to what it covers: 1 − its albedo, of its brightest colour."""
    return max(ONE - largest(closure.f0) * share(closure.roughness, cos), ZERO)


@part
def _tangent(view):
    """Cosine and sine of the azimuth of a direction."""
    radius = np.sqrt(view[0] * view[0] + view[1] * view[1])
    if radius < _TINY:
        return ONE, ZERO
    return view[0] / radius, view[1] / radius


@part
def _transform(closure, cos):
    """The transform (a, b) of what is seen at `cos`."""
    x, y = min(max(cos, ZERO), ONE), max(closure.roughness, _LEAST_ROUGHNESS)
    a = (_A[0] * x + _A[1] * y) * y / (ONE + _A[2] * x * x + _A[3] * x * y)
    b = np.sqrt(ONE - x) * (y - ONE) * (y * y * y) / (_B[0] + _B[1] * x + _B[2] * x * y + _B[3] * y * y)
    return a, b


@part
def share(roughness, cos):
    """Albedo of a white lobe, R: a Gaussian of the cosine over an offset."""
    x, y = min(max(cos, ZERO), ONE), max(roughness, _LEAST_ROUGHNESS)
    width = y * (_WIDTH[0] + _WIDTH[1] * y) / (_WIDTH[2] + y * (_WIDTH[3] + y))
    center = y * (_MEAN[0] + y * (_MEAN[1] + y * (_MEAN[2] + _MEAN[3] * y * y))) / (_MEAN[4] + y)
    offset = y * (_OFFSET[0] + (_OFFSET[1] + _OFFSET[2] * y) * y) / (_OFFSET[3] + y * (_OFFSET[4] + y))
    away = (x - center) / width
    return min(max(np.exp(-_HALF * away * away) * _PER_ROOT_2_PI / width + offset, ZERO), ONE)
