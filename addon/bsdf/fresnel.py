"""Fresnel's equations, and the curves that take a lobe's reflectance from normal to grazing incidence.

An index of refraction is that of the far side over that of the near side.
"""

import numpy as np

from ..core.compiling import part
from ..core.vec3 import ONE, ZERO, minus, plus, times
from ..scene.closures import FresnelCurve
from .facets import metal, thin_film

_DIELECTRIC = int(FresnelCurve.DIELECTRIC)
_TINY, _HALF = np.float32(1e-20), np.float32(0.5)
_SCHLICK_AVERAGE = np.float32(1 / 21)
_INTO = np.float32(4.08567), np.float32(1.00071)
_OUT_OF = np.float32(0.997118), np.float32(0.1014), np.float32(0.965241), np.float32(0.130607)


@part
def fresnel_dielectric(cos, ior):
    """Share of unpolarised light that a smooth dielectric reflects; 1 in total internal reflection.

    Walter et al., "Microfacet Models for Refraction through Rough Surfaces", 2007, equation 22. Where it has no real
    solution g is taken as 0, which makes the share 1.
    """
    g = np.sqrt(max(ior * ior - ONE + cos * cos, ZERO))
    a = (g - cos) / (g + cos + _TINY)
    b = (cos * (g + cos) - ONE) / (cos * (g - cos) + ONE + _TINY)
    return a * a * (ONE + b * b) * _HALF


@part
def normal_reflectance(ior):
    """Reflectance of a smooth dielectric at normal incidence, ((η − 1)/(η + 1))²."""
    ratio = (ior - ONE) / (ior + ONE)
    return ratio * ratio


@part
def grazing_share(cos, ior):
    """The s in F = f0 + (f90 − f0) s: Fresnel's curve for `ior` rescaled to [0, 1], or Schlick's (1 − cos)⁵ for 0."""
    if ior > ZERO:
        f0 = normal_reflectance(ior)
        return max((fresnel_dielectric(cos, ior) - f0) / (ONE - f0 + _TINY), ZERO)
    m = ONE - cos
    return m * m * (m * m) * m


@part
def average_grazing_share(ior):
    """Cosine-weighted average of `grazing_share` over the hemisphere.

    The average of Fresnel's reflectance is the fit of Kulla and Conty, "Revisiting Physically Based Shading at
    Imageworks", 2017; of Schlick's curve it is 1/21.
    """
    if ior <= ZERO:
        return _SCHLICK_AVERAGE
    average = (ior - ONE) / (_INTO[0] + _INTO[1] * ior)
    if ior < ONE:
        average = _OUT_OF[0] + ior * (_OUT_OF[1] - ior * (_OUT_OF[2] + ior * _OUT_OF[3]))
    f0 = normal_reflectance(ior)
    return min(max((average - f0) / (ONE - f0 + _TINY), ZERO), ONE)


@part
def reflectance(closure, cos):
    """What facets of a glossy closure reflect that are seen at `cos`, by their film or by its curve."""
    if closure.film[0] > ZERO:
        return thin_film.reflectances(closure.film, closure.curve, cos, closure.f0, closure.edge, closure.ior)
    if closure.curve != _DIELECTRIC:
        return metal.reflectances(closure.curve, cos, closure.f0, closure.edge)
    return plus(closure.f0, times(minus(closure.f90, closure.f0), grazing_share(cos, closure.ior)))


@part
def average_reflectance(closure):
    """Its cosine-weighted average over the hemisphere, as if there were no film."""
    if closure.curve != _DIELECTRIC:
        return metal.averages(closure.curve, closure.f0, closure.edge)
    return plus(closure.f0, times(minus(closure.f90, closure.f0), average_grazing_share(closure.ior)))


@part
def glass_reflectance(film, ior, cos):
    """What facets of glass with a film on them reflect that are seen at `cos`."""
    if film[0] > ZERO:
        f0 = normal_reflectance(ior)
        bare = f0, f0, f0
        return thin_film.reflectances(film, _DIELECTRIC, cos, bare, bare, ior)
    reflected = fresnel_dielectric(cos, ior)
    return reflected, reflected, reflected
