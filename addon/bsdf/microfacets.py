"""Microfacets of any distribution: how they mask each other, how they are sampled, and where they send light.

The local frame has the surface's normal as +z and the tangent as +x. Vectors are unit; α, the width of a distribution,
is the square of the roughness, along x and along y. α = 0 is a perfect mirror, of which only the sampling makes sense.
"""

from typing import NamedTuple

import numpy as np

from ..core.compiling import part
from ..core.vec3 import ONE, TWO, ZERO, dot, minus, times
from ..scene.closures import Distribution
from .facets import ashikhmin_shirley, beckmann, ggx

MIN_COS = np.float32(1e-6)
"""Of directions that graze the surface, which rounding may put on it."""

_GGX, _BECKMANN = int(Distribution.GGX), int(Distribution.BECKMANN)
_FOUR = np.float32(4)


class Facets(NamedTuple):
    """The facets of a surface: `Distribution`, and its widths along the tangent and across it."""

    distribution: np.int32
    alpha_x: np.float32
    alpha_y: np.float32


@part
def one_plus_lambda(facets, w):
    """1 + Λ of a direction on either side: 1/G₁, G₁ being the share of the facets that it sees (Smith's masking).

    Not of Ashikhmin's and Shirley's facets.
    """
    x, y, z = facets.alpha_x * w[0], facets.alpha_y * w[1], max(abs(w[2]), MIN_COS)
    slope2 = (x * x + y * y) / (z * z)
    if facets.distribution == _GGX:
        return ggx.one_plus_lambda(slope2)
    return beckmann.one_plus_lambda(slope2)


@part
def g2_over_g1(facets, wo, wi):
    """G₂/G₁: the share of the facets seen from wo that are also seen from wi, which is f |cos| over its density and F.

    Heights are correlated: Heitz 2014, equation 99, G₂ = 1/(1 + Λo + Λi).
    """
    if facets.distribution > _BECKMANN:
        return min(abs(wi[2]) / max(abs(wo[2]), MIN_COS), ONE)
    of_wo = one_plus_lambda(facets, wo)
    return of_wo / (of_wo + one_plus_lambda(facets, wi) - ONE)


@part
def visible_normal(facets, wo, u, v):
    """The normal of a facet, sampled from wo."""
    wo = wo[0], wo[1], max(wo[2], MIN_COS)
    if facets.distribution == _GGX:
        return ggx.visible_normal(wo, facets.alpha_x, facets.alpha_y, u, v)
    if facets.distribution == _BECKMANN:
        return beckmann.visible_normal(wo, facets.alpha_x, facets.alpha_y, u, v)
    return ashikhmin_shirley.normal(facets.alpha_x, facets.alpha_y, u, v)


@part
def pdf_reflected(facets, wo, h):
    """Density by solid angle of the direction that wo is reflected to by facets with normal h, when these are sampled.

    Some samples are shadowed by the surface, so that it integrates to less than 1 over those that leave it.
    """
    if facets.distribution > _BECKMANN:
        d = ashikhmin_shirley.distribution(h, facets.alpha_x, facets.alpha_y)
        return d / (_FOUR * max(abs(dot(wo, h)), MIN_COS))
    if facets.distribution == _GGX:
        d = ggx.distribution(h, facets.alpha_x, facets.alpha_y)
    else:
        d = beckmann.distribution(h, facets.alpha_x, facets.alpha_y)
    return d / (_FOUR * max(wo[2], MIN_COS) * one_plus_lambda(facets, wo))


@part
def reflect(wo, h, cos):
    """Where wo is mirrored to about h; `cos` is wo·h."""
    return minus(times(h, TWO * cos), wo)


@part
def refract(wo, h, cos, ior):
    """Where wo is refracted to by facets with normal h; `cos` is wo·h, and `ior` that of the far side over wo's.

    Walter et al. 2007, equation 40. In total internal reflection the direction is meaningless.
    """
    cos_t = np.sqrt(max(ONE - (ONE - cos * cos) / (ior * ior), ZERO))
    return minus(times(h, cos / ior - cos_t), times(wo, ONE / ior))
