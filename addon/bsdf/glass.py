"""Reflection and refraction by clear facets; f0 is the colour of what is reflected, f90 of what is transmitted.

The density of both has the same factors as f: Walter et al. 2007, equations 17, 20, 21. Radiance is not scaled by η²
at an interface, as Cycles does not: f of the refraction is Walter's times (η_light/η_view)², by which a path's weight
is T G₂/G₁. Walter's f obeys f(o→i)/η_i² = f(i→o)/η_o² (Veach, "Robust Monte Carlo Methods for Light Transport
Simulation", 1997, section 5.2), by which a photon's weight with Walter's f would be T G₂/G₁, and with this one is
T G₂/G₁ (η_light/η_view)².
"""

from typing import NamedTuple

import numpy as np

from ..core.compiling import part, routine
from ..core.vec3 import BLACK, ONE, WHITE, ZERO, dot, mean, minus, mul, times
from .albedo_tables import (
    GLASS,
    GLASS_AVERAGE,
    glass_coordinate,
    interpolate_2,
    interpolate_3,
    multiple_scattering_of,
)
from .closure import facets_of, radiance_scale
from .fresnel import fresnel_dielectric, glass_reflectance
from .microfacets import g2_over_g1, reflect, refract, visible_normal

_LEAST_SHARE, _MOST_SHARE = np.float32(0.05), np.float32(0.95)
_TINY = np.float32(1e-20)


class Facet(NamedTuple):
    """A facet of glass: its normal, the cosine to where it is seen from, and the colours of what goes both ways."""

    normal: tuple
    cos: np.float32
    reflected: tuple
    transmitted: tuple


@routine
def albedo(closure, cos, from_light):
    """What it scatters of light from a direction, about; above 0 wherever it scatters any."""
    reflected = ZERO
    if closure.fresnel:  # a rough surface also does what a smooth one would not
        reflected = min(max(fresnel_dielectric(cos, closure.ior), _LEAST_SHARE), _MOST_SHARE)
    transmitted = (ONE - reflected) * radiance_scale(closure.ior, from_light)
    return mean(closure.weight) * (reflected * mean(closure.f0) + transmitted * mean(closure.f90))


@routine
def sample(closure, wo, choice, u, v, from_light):
    """Reflection or refraction, chosen by what each scatters: a direction, and f |cos| over its density."""
    facet = facet_of(closure, wo, u, v)
    up = mean(mul(facet.reflected, closure.f0))
    down = mean(mul(facet.transmitted, closure.f90)) * radiance_scale(closure.ior, from_light)
    reflects = choice * (up + down) < up
    wi, weight = scatter(closure, wo, facet, reflects, from_light)
    probability = (up if reflects else down) / max(up + down, _TINY)
    return wi, times(weight, ONE / max(probability, _TINY))


@routine
def facet_of(closure, wo, u, v):
    """A facet that is seen from wo."""
    h = visible_normal(facets_of(closure), wo, u, v)
    cos = dot(wo, h)
    if closure.fresnel:
        reflected = glass_reflectance(closure.film, closure.ior, cos)
        return Facet(h, cos, reflected, minus(WHITE, reflected))
    return Facet(h, cos, BLACK, WHITE if fresnel_dielectric(cos, closure.ior) < ONE else BLACK)


@routine
def scatter(closure, wo, facet, reflects, from_light):
    """Where a facet sends the light that it reflects, or else the light that it refracts; and its weight."""
    ior, color = closure.ior, closure.f0 if reflects else closure.f90
    if reflects:
        wi, share = reflect(wo, facet.normal, facet.cos), mul(facet.reflected, color)
    else:
        wi, transmitted = refract(wo, facet.normal, facet.cos, ior), facet.transmitted
        if from_light and closure.film[0] > ZERO:
            transmitted = _transmitted_to_view(closure, abs(dot(wi, facet.normal)))
        share = times(mul(transmitted, color), radiance_scale(ior, from_light))
    if (wi[2] > ZERO) != reflects:
        return wi, BLACK
    left = g2_over_g1(facets_of(closure), wo, wi)
    view, view_ior = wo[2], ior
    if from_light:
        view = abs(wi[2])
        view_ior = ior if reflects else ONE / ior
    return wi, times(mul(closure.weight, mul(share, _scale(closure, view, view_ior))), left)


@part
def _transmitted_to_view(closure, cos):
    """What filmed glass transmits to a view beyond it, seen there at `cos`.

    As Cycles has it, the optical path in the film is measured by the index of refraction over that of the viewing side,
    so that from inside the film looks thinner.
    """
    ior = closure.ior
    film = closure.film[0], closure.film[1] / ior, closure.film[2]
    return minus(WHITE, glass_reflectance(film, ONE / ior, cos))


@part
def _scale(closure, cos, ior):
    """What multiple scattering multiplies the lobe by; as Cycles has it, its colour is what transmits.

    `ior` is that beyond the surface over that of the viewing side.
    """
    if not (closure.preserves_energy and closure.fresnel):
        return WHITE
    z = glass_coordinate(ior)
    white = interpolate_3(GLASS, z, closure.roughness, cos)
    return multiple_scattering_of(closure.f90, white, interpolate_2(GLASS_AVERAGE, z, closure.roughness))
