"""Toon: light that comes within an angle of an axis, the normal or the mirrored view, with an edge of some width.

f cos = I(θ)/(2π (1 − cos θs)), where I is 1 up to the angle of `roughness` · π/2, goes to 0 in a straight line over
`f90` · π/2 more, and θs ≤ π/2 is where it ends. Since the cosine is that of the light, the lobe is not reciprocal.
"""

import numpy as np

from ...core.compiling import part
from ...core.sampling.warps import PI, at_versine, cosine_hemisphere
from ...core.vec3 import BLACK, ONE, TWO, ZERO, dot, times, to_world
from ...scene.closures import Lobe

_GLOSSY_TOON = int(Lobe.GLOSSY_TOON)
_RIGHT_ANGLE, _LEAST_SIZE, _TINY = np.float32(np.pi / 2), np.float32(1e-5), np.float32(1e-6)
_HALF, _PER_TWO_PI = np.float32(0.5), np.float32(1 / (2 * np.pi))


@part
def sample(closure, wo, u, v, from_light):
    """A direction, and f |cos| over its density: evenly within the lobe's angle, or of a photon around the normal."""
    size, edge, end = _angles(closure)
    if closure.kind != _GLOSSY_TOON and from_light:
        wi = cosine_hemisphere(u, v)
        return wi, times(evaluate(closure, wi, wo), PI)
    versine = u * _versine(end)
    wi = at_versine(versine, v)
    share = _intensity(size, edge, _angle_of(versine))
    if closure.kind == _GLOSSY_TOON:
        wi = to_world(wi, _mirrored(wo))
        if from_light:
            share *= wi[2] / max(wo[2], _TINY)
    return wi, times(closure.weight, share) if wi[2] > ZERO else BLACK


@part
def evaluate(closure, view, light):
    """The lobe's f in 1/sr, without the cosine."""
    if view[2] <= ZERO or light[2] <= ZERO:
        return BLACK
    size, edge, end = _angles(closure)
    share = _intensity(size, edge, _angle_to_axis(closure, view, light)) * _PER_TWO_PI / _versine(end)
    return times(closure.weight, share / max(light[2], _TINY))


@part
def pdf(closure, view, light):
    """Density of `light` by solid angle when sampled from `view`."""
    if view[2] <= ZERO or light[2] <= ZERO:
        return ZERO
    _, _, end = _angles(closure)
    return _PER_TWO_PI / _versine(end) if _angle_to_axis(closure, view, light) < end else ZERO


@part
def albedo(closure):
    """Albedo, ∫ I sin θ dθ/(1 − cos θs); of the glossy one without what its horizon cuts off."""
    size, edge, end = _angles(closure)
    share = ONE
    if edge > ZERO:
        left = _intensity(size, edge, end)
        share = (ONE - left * np.cos(end) - (np.sin(end) - np.sin(size)) / edge) / _versine(end)
    return times(closure.weight, min(max(share, ZERO), ONE))


@part
def _angles(closure):
    """The angle where the edge begins, the edge's width, and where it ends."""
    size = min(max(closure.roughness, _LEAST_SIZE), ONE) * _RIGHT_ANGLE
    edge = min(max(closure.f90[0], ZERO), ONE) * _RIGHT_ANGLE
    return size, edge, min(size + edge, _RIGHT_ANGLE)


@part
def _intensity(size, edge, angle):
    if angle < size:
        return ONE
    return max(ONE - (angle - size) / edge, ZERO) if edge > ZERO else ZERO


@part
def _angle_to_axis(closure, view, light):
    """Angle between the light and the axis."""
    if closure.kind != _GLOSSY_TOON:
        return np.arccos(min(light[2], ONE))
    return np.arccos(min(max(dot(_mirrored(view), light), ZERO), ONE))


@part
def _mirrored(w):
    return -w[0], -w[1], w[2]


@part
def _versine(angle):
    """1 − cos."""
    sin = np.sin(angle * _HALF)
    return TWO * sin * sin


@part
def _angle_of(versine):
    return TWO * np.arcsin(min(np.sqrt(versine * _HALF), ONE))
