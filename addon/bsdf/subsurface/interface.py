"""How views and light pass the surface of a body: through clear facets, or a share of them by the cosine.

Cycles refracts a view by a visible facet, or for skin half of the time takes a direction by the cosine, and does not
ask what is reflected: its layers have taken that. The density p of the directions inside is normalized. In the local
frame the side of the view, and of the light that leaves, is +z.
"""

from typing import NamedTuple

import numpy as np

from ...core.compiling import routine
from ...core.sampling.warps import cosine_hemisphere
from ...core.vec3 import ONE, ZERO, dot, negative
from ...scene.closures import Distribution
from ..microfacets import Facets, one_plus_lambda, refract, visible_normal

_GGX = np.int32(Distribution.GGX)


class Passed(NamedTuple):
    """A direction beyond the surface, and the weight of what took it; 0 for none."""

    direction: tuple
    weight: np.float32


@routine
def enter(medium, wo, choice, u, v):
    """Where a view from wo goes on in the body: the density is p(ω₀ | wo)."""
    if choice < medium.spread:
        return Passed(negative(cosine_hemisphere(u, v)), ONE)
    facets = Facets(_GGX, medium.roughness, medium.roughness)
    h = visible_normal(facets, wo, u, v)
    inside = refract(wo, h, dot(wo, h), medium.ior)
    return Passed(inside, ONE if inside[2] < ZERO else ZERO)


@routine
def leave(medium, inside, choice, u, v):
    """Where light goes that comes to the surface from inside, flying along a direction with z > 0: `enter` backwards.

    With visible facets sampled from either side, the ratio of p cos θo/cos θ₀ to the density of the direction is
    η² G₁(ωo)/G₁(ω₀): of Walter et al. 2007, equation 17, all but the squares of the indices and the masking cancels.
    """
    if choice < medium.spread:
        return Passed(cosine_hemisphere(u, v), ONE)
    facets = Facets(_GGX, medium.roughness, medium.roughness)
    back = -inside[0], -inside[1], inside[2]  # with the inside as +z
    h = visible_normal(facets, back, u, v)
    cos, ior = dot(back, h), ONE / medium.ior
    if ONE - cos * cos >= ior * ior or cos <= ZERO:  # reflected totally
        return Passed(inside, ZERO)
    outside = refract(back, h, cos, ior)
    if outside[2] >= ZERO:
        return Passed(inside, ZERO)
    weight = medium.ior * medium.ior * one_plus_lambda(facets, back) / one_plus_lambda(facets, outside)
    return Passed((outside[0], outside[1], -outside[2]), weight)
