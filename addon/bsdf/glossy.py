"""Reflection by facets with their Fresnel curve: metal, gloss, and a dielectric layer over other closures.

What GGX facets reflect in all is tabulated and stands for those of other distributions, too: there it says no more than
how much a closure scatters about, for choices between closures, and what a layer leaves, as Cycles has it. Energy is
preserved of GGX alone.
"""

import numpy as np

from ..core.compiling import part, routine
from ..core.vec3 import BLACK, ONE, WHITE, ZERO, dot, largest, mul, normalized, plus, times
from .albedo_tables import (
    GRAZING,
    GRAZING_OF_FACETS,
    WHITE_AVERAGE,
    curve_coordinate,
    interpolate_1,
    interpolate_2,
    interpolate_3,
    multiple_scattering,
    multiple_scattering_of,
)
from .albedo_tables import WHITE as WHITE_ALBEDO
from .closure import facets_of
from .fresnel import average_grazing_share, average_reflectance, reflectance
from .microfacets import MIN_COS, g2_over_g1, pdf_reflected, reflect, visible_normal

SMOOTH = np.float32(0.1)
"""Roughness below which a glossy lobe is a mirror to those who look for lamps: only photons find them there."""

PEAK = np.float32(1)
"""Value of a glossy lobe, 1/sr, from which on light is left to photons in any case: three times what white paper has.

Few rays meet such highlights, and they are bright: in a room with sunlit metal and lacquer a bound of 10 leaves little
more of the light to rays, and most of their variance comes from that.
"""


@routine
def albedo(closure, cos):
    """Directional albedo, of light that leaves (or comes) at `cos` to the normal."""
    white = interpolate_2(WHITE_ALBEDO, closure.roughness, cos)
    if closure.film[0] > ZERO:
        return mul(closure.weight, times(mul(reflectance(closure, cos), _scale(closure, white)), white))
    grazing = interpolate_3(GRAZING, curve_coordinate(closure.ior), closure.roughness, cos)
    single = plus(times(closure.f0, white - grazing), times(closure.f90, grazing))
    return mul(closure.weight, mul(single, _scale(closure, white)))


@routine
def transmittance(closure, cos):
    """Share of the light that a layer leaves to what it covers: 1 − its albedo, seen at `cos`.

    As Cycles has it, its albedo is that of its facets, with the largest component of f0, times what multiple scattering
    makes of the white lobe's albedo where energy is preserved; where it is not, what the facets shadow is taken from
    what is covered as well. What a film reflects of it is that of level facets.
    """
    f0, f90 = largest(closure.f0), largest(closure.f90)
    if f90 <= ZERO:
        return ONE
    grazing = interpolate_3(GRAZING_OF_FACETS, curve_coordinate(closure.ior), closure.roughness, cos)
    reflected = f0 + (f90 - f0) * grazing
    if closure.film[0] > ZERO:
        reflected = largest(reflectance(closure, cos))
    if closure.preserves_energy:
        white = interpolate_2(WHITE_ALBEDO, closure.roughness, cos)
        average = f0 + (f90 - f0) * average_grazing_share(closure.ior)
        of_white = interpolate_1(WHITE_AVERAGE, closure.roughness)
        reflected *= white * multiple_scattering(average, white, of_white)
    return min(max(ONE - reflected, ZERO), ONE)


@routine
def sample(closure, wo, u, v, from_light):
    """A direction by the visible normals, and f |cos| over its density, of which only F G₂/G₁ is left.

    Heitz 2018, equation 19.
    """
    facets = facets_of(closure)
    h = visible_normal(facets, wo, u, v)
    cos = dot(wo, h)
    wi = reflect(wo, h, cos)
    if wi[2] <= ZERO:
        return wi, BLACK
    view = wi[2] if from_light else wo[2]
    scale = _scale(closure, interpolate_2(WHITE_ALBEDO, closure.roughness, view))
    return wi, times(mul(closure.weight, mul(reflectance(closure, cos), scale)), g2_over_g1(facets, wo, wi))


@routine
def evaluate(closure, wo, wi):
    """The lobe's f in 1/sr, without the cosine; wo is the viewing side. 0 where it is smooth.

    Walter et al. 2007, equation 20.
    """
    if closure.roughness < SMOOTH or wo[2] <= ZERO or wi[2] <= ZERO:
        return BLACK
    h, facets = normalized(plus(wo, wi)), facets_of(closure)
    scale = _scale(closure, interpolate_2(WHITE_ALBEDO, closure.roughness, max(wo[2], MIN_COS)))
    f = mul(closure.weight, mul(reflectance(closure, dot(wo, h)), scale))
    return times(f, pdf_reflected(facets, wo, h) * g2_over_g1(facets, wo, wi) / max(wi[2], MIN_COS))


@routine
def pdf(closure, wo, wi):
    """Density of wi by solid angle when sampled from wo; 0 where it is smooth."""
    if closure.roughness < SMOOTH or wo[2] <= ZERO or wi[2] <= ZERO:
        return ZERO
    return pdf_reflected(facets_of(closure), wo, normalized(plus(wo, wi)))


@part
def is_specular(closure, view, light):
    """Whether lamplight from `light` to `view` is left to photons, as it is for mirrors and for the peaks of gloss.

    The rest is for shadow rays: each way of the light is found once, by those who find it better.
    """
    return closure.roughness < SMOOTH or largest(evaluate(closure, view, light)) >= PEAK


@part
def _scale(closure, white):
    """What multiple scattering multiplies the lobe by; 1 where energy is not preserved."""
    if not closure.preserves_energy:
        return WHITE
    of_white = interpolate_1(WHITE_AVERAGE, closure.roughness)
    return multiple_scattering_of(average_reflectance(closure), white, of_white)
