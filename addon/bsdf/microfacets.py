"""GGX microfacets: how they are distributed, how they mask each other, and how the visible ones are sampled.

The local frame has the surface's normal as +z. Vectors are unit, (n, 3) float32; α, the width of the distribution,
is the square of the roughness. α = 0 is a perfect mirror, of which only the sampling makes sense.
"""

import numpy as np

from ..core.sampling.vectors import dot
from ..core.sampling.warps import TWO_PI

MIN_COS = np.float32(1e-6)
"""Of directions that graze the surface, which rounding may put on it."""


def distribution(h: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """Microfacet normals h an area and solid angle, D(h), (n,) in 1/sr.

    Walter et al. 2007, equation 33, with the sine from x and y, which keeps its digits close to the normal.
    """
    alpha2 = alpha * alpha
    spread = h[:, 0] * h[:, 0] + h[:, 1] * h[:, 1] + alpha2 * (h[:, 2] * h[:, 2])
    return alpha2 / (np.float32(np.pi) * spread * spread)


def masked(cos: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """1 + Λ of directions at `cos` to the normal, so that 1/masked is the share of facets that they see, G₁.

    Heitz, "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", 2014, equation 72.
    """
    cos = np.maximum(np.abs(cos), MIN_COS)
    tan = alpha / cos
    return (1 + np.sqrt(1 + tan * tan * (1 - cos * cos))) / 2


def unshadowed(cos_o: np.ndarray, cos_i: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """G₂/G₁: share of the facets seen from one side that are also seen from the other, heights correlated.

    Heitz 2014, equation 99: G₂ = 1/(1 + Λo + Λi).
    """
    seen = masked(cos_o, alpha)
    return seen / (seen + masked(cos_i, alpha) - 1)


def sample_visible_normals(wo: np.ndarray, alpha: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Normals of the facets that are seen from wo, (n, 3), by u (n, 2): density G₁(wo) D(h) (wo·h)/wo.z.

    Heitz, "Sampling the GGX Distribution of Visible Normals", 2018: stretched so that α is 1, the facets are a
    hemisphere. Its visible normals are the half vectors of wo and of directions uniform on a spherical cap: Dupuy and
    Benyoub, "Sampling Visible GGX Normals with Spherical Caps", 2023.
    """
    x, y, z = alpha * wo[:, 0], alpha * wo[:, 1], np.maximum(wo[:, 2], MIN_COS)
    scale = 1 / np.sqrt(x * x + y * y + z * z)
    x, y, z = x * scale, y * scale, z * scale
    height = (1 - u[:, 1]) * (1 + z)  # of the half vector: the cap's own is `height − z`
    cap_z = height - z
    r, phi = np.sqrt(np.maximum(1 - cap_z * cap_z, 0)), TWO_PI * u[:, 0]
    h = np.stack([alpha * (x + r * np.cos(phi)), alpha * (y + r * np.sin(phi)), height], axis=1)
    h /= np.sqrt(dot(h, h))[:, None]
    return h


def reflect(wo: np.ndarray, h: np.ndarray, cos: np.ndarray) -> np.ndarray:
    """Where wo is mirrored to about h; `cos` is wo·h."""
    return (2 * cos)[:, None] * h - wo


def refract(wo: np.ndarray, h: np.ndarray, cos: np.ndarray, ior: np.ndarray) -> np.ndarray:
    """Where wo is refracted to by facets with normal h; `cos` is wo·h, and `ior` that of the far side over wo's.

    Walter et al. 2007, equation 40. In total internal reflection the direction is meaningless.
    """
    cos_t = np.sqrt(np.maximum(1 - (1 - cos * cos) / (ior * ior), 0))
    return (cos / ior - cos_t)[:, None] * h - wo / ior[:, None]
