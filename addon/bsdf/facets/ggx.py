"""GGX: facets whose normals, stretched by 1/α, are those of a hemisphere."""

import numpy as np

from ...core.compiling import part
from ...core.sampling.warps import PI, TWO_PI
from ...core.vec3 import ONE, ZERO, normalized

_HALF = np.float32(0.5)


@part
def distribution(h, alpha_x, alpha_y):
    """Microfacet normals h an area and solid angle, D(h), in 1/sr.

    Walter et al. 2007, equation 33, with the sine from x and y, which keeps its digits close to the normal; anisotropic
    as by Heitz 2014, equation 85.
    """
    area = alpha_x * alpha_y
    spread = h[0] * h[0] * (alpha_y / alpha_x) + h[1] * h[1] * (alpha_x / alpha_y) + h[2] * h[2] * area
    return area / (PI * spread * spread)


@part
def one_plus_lambda(slope2):
    """1 + Λ of directions with the squared slope (α tan θ)², which is 1/G₁.

    Heitz, "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", 2014, equation 72.
    """
    return (ONE + np.sqrt(ONE + slope2)) * _HALF


@part
def visible_normal(wo, alpha_x, alpha_y, u, v):
    """The normal of a facet that is seen from wo: density G₁(wo) D(h) (wo·h)/wo.z.

    Heitz, "Sampling the GGX Distribution of Visible Normals", 2018: stretched so that α is 1, the facets are a
    hemisphere. Its visible normals are the half vectors of wo and of directions uniform on a spherical cap: Dupuy and
    Benyoub, "Sampling Visible GGX Normals with Spherical Caps", 2023.
    """
    x, y, z = normalized((alpha_x * wo[0], alpha_y * wo[1], wo[2]))
    height = (ONE - v) * (ONE + z)  # of the half vector: the cap's own is `height − z`
    cap_z = height - z
    r, phi = np.sqrt(max(ONE - cap_z * cap_z, ZERO)), TWO_PI * u
    return normalized((alpha_x * (x + r * np.cos(phi)), alpha_y * (y + r * np.sin(phi)), height))
