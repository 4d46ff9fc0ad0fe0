"""GGX microfacets: how they are distributed, how they mask each other, and how the visible ones are sampled.

The local frame has the surface's normal as +z. Vectors are unit; α, the width of the distribution, is the square of
the roughness. α = 0 is a perfect mirror, of which only the sampling makes sense.
"""

import numpy as np

from ..core.compiling import part
from ..core.sampling.warps import TWO_PI
from ..core.vec3 import ONE, TWO, ZERO, minus, normalized, times

MIN_COS = np.float32(1e-6)
"""Of directions that graze the surface, which rounding may put on it."""

_PI, _HALF = np.float32(np.pi), np.float32(0.5)


@part
def distribution(h, alpha):
    """Microfacet normals h an area and solid angle, D(h), in 1/sr.

    Walter et al. 2007, equation 33, with the sine from x and y, which keeps its digits close to the normal.
    """
    alpha2 = alpha * alpha
    spread = h[0] * h[0] + h[1] * h[1] + alpha2 * (h[2] * h[2])
    return alpha2 / (_PI * spread * spread)


@part
def masked(cos, alpha):
    """1 + Λ of directions at `cos` to the normal, so that 1/masked is the share of facets that they see, G₁.

    Heitz, "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", 2014, equation 72.
    """
    cos = max(abs(cos), MIN_COS)
    tan = alpha / cos
    return (ONE + np.sqrt(ONE + tan * tan * (ONE - cos * cos))) * _HALF


@part
def unshadowed(cos_o, cos_i, alpha):
    """G₂/G₁: share of the facets seen from one side that are also seen from the other, heights correlated.

    Heitz 2014, equation 99: G₂ = 1/(1 + Λo + Λi).
    """
    seen = masked(cos_o, alpha)
    return seen / (seen + masked(cos_i, alpha) - ONE)


@part
def visible_normal(wo, alpha, u, v):
    """The normal of a facet that is seen from wo: density G₁(wo) D(h) (wo·h)/wo.z.

    Heitz, "Sampling the GGX Distribution of Visible Normals", 2018: stretched so that α is 1, the facets are a
    hemisphere. Its visible normals are the half vectors of wo and of directions uniform on a spherical cap: Dupuy and
    Benyoub, "Sampling Visible GGX Normals with Spherical Caps", 2023.
    """
    x, y, z = normalized((alpha * wo[0], alpha * wo[1], max(wo[2], MIN_COS)))
    height = (ONE - v) * (ONE + z)  # of the half vector: the cap's own is `height − z`
    cap_z = height - z
    r, phi = np.sqrt(max(ONE - cap_z * cap_z, ZERO)), TWO_PI * u
    return normalized((alpha * (x + r * np.cos(phi)), alpha * (y + r * np.sin(phi)), height))


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
