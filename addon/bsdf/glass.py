"""Reflection and refraction by clear GGX facets; f0 is the colour of what is reflected, f90 of what is transmitted.

The density of both has the same factors as f: Walter et al. 2007, equations 17, 20, 21. Radiance is not scaled by η²
at an interface, as Cycles does not: f of the refraction is Walter's times (η_light/η_view)², by which a path's weight
is T G₂/G₁. Walter's f obeys f(o→i)/η_i² = f(i→o)/η_o² (Veach, "Robust Monte Carlo Methods for Light Transport
Simulation", 1997, section 5.2), by which a photon's weight with Walter's f would be T G₂/G₁, and with this one is
T G₂/G₁ (η_light/η_view)².
"""

from typing import NamedTuple

import numpy as np

from ..core.compiling import part, routine
from ..core.vec3 import BLACK, ONE, WHITE, ZERO, dot, mean, mul, times
from .albedo_tables import (
    GLASS,
    GLASS_AVERAGE,
    glass_coordinate,
    interpolate_2,
    interpolate_3,
    multiple_scattering_of,
)
from .closure import alpha_of, radiance_scale
from .fresnel import fresnel_dielectric
from .microfacets import reflect, refract, unshadowed, visible_normal

_LEAST_SHARE, _MOST_SHARE = np.float32(0.05), np.float32(0.95)
_TINY = np.float32(1e-20)


class Facet(NamedTuple):
    """A facet of glass: its normal, the cosine to where it is seen from, and the shares of light of both ways."""

    normal: tuple
    cos: np.float32
    reflected: np.float32
    transmitted: np.float32


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
    up = facet.reflected * mean(closure.f0)
    down = facet.transmitted * mean(closure.f90) * radiance_scale(closure.ior, from_light)
    reflects = choice * (up + down) < up
    wi, weight = scatter(closure, wo, facet, reflects, from_light)
    probability = (up if reflects else down) / max(up + down, _TINY)
    return wi, times(weight, ONE / max(probability, _TINY))


@routine
def facet_of(closure, wo, u, v):
    """A facet that is seen from wo."""
    h = visible_normal(wo, alpha_of(closure), u, v)
    cos = dot(wo, h)
    fresnel = fresnel_dielectric(cos, closure.ior)
    if closure.fresnel:
        return Facet(h, cos, fresnel, ONE - fresnel)
    return Facet(h, cos, ZERO, ONE if fresnel < ONE else ZERO)


@routine
def scatter(closure, wo, facet, reflects, from_light):
    """Where a facet sends the light that it reflects, or else the light that it refracts; and its weight."""
    ior, color = closure.ior, closure.f0 if reflects else closure.f90
    if reflects:
        wi, share = reflect(wo, facet.normal, facet.cos), facet.reflected
    else:
        wi = refract(wo, facet.normal, facet.cos, ior)
        share = facet.transmitted * radiance_scale(ior, from_light)
    if (wi[2] > ZERO) != reflects:
        return wi, BLACK
    share = share * unshadowed(wo[2], wi[2], alpha_of(closure))
    view, view_ior = wo[2], ior
    if from_light:
        view = abs(wi[2])
        view_ior = ior if reflects else ONE / ior
    return wi, times(mul(closure.weight, mul(color, _scale(closure, view, view_ior))), share)


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
