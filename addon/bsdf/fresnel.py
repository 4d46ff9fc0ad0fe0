"""Fresnel's equations, and the curves that take a lobe's reflectance from normal to grazing incidence.

An index of refraction is that of the far side over that of the near side. Arrays are float32 and broadcast.
"""

import numpy as np

_TINY = np.float32(1e-20)
_SCHLICK_AVERAGE = np.float32(1 / 21)


def fresnel_dielectric(cos: np.ndarray, ior: np.ndarray) -> np.ndarray:
    """Share of unpolarised light that a smooth dielectric reflects; 1 in total internal reflection.

    Walter et al., "Microfacet Models for Refraction through Rough Surfaces", 2007, equation 22. Where it has no real
    solution g is taken as 0, which makes the share 1.
    """
    g = np.sqrt(np.maximum(ior * ior - 1 + cos * cos, 0))
    a = (g - cos) / (g + cos + _TINY)
    b = (cos * (g + cos) - 1) / (cos * (g - cos) + 1 + _TINY)
    return a * a * (1 + b * b) / 2


def normal_reflectance(ior: np.ndarray) -> np.ndarray:
    """Reflectance of a smooth dielectric at normal incidence, ((η − 1)/(η + 1))²."""
    return np.square((ior - 1) / (ior + 1))


def grazing_share(cos: np.ndarray, ior: np.ndarray) -> np.ndarray:
    """The s in F = f0 + (f90 − f0) s: Fresnel's curve for `ior` rescaled to [0, 1], or Schlick's (1 − cos)⁵ for 0."""
    f0 = normal_reflectance(ior)
    exact = (fresnel_dielectric(cos, ior) - f0) / (1 - f0 + _TINY)
    m = 1 - cos
    return np.where(ior > 0, np.maximum(exact, 0), m * m * (m * m) * m)


def average_grazing_share(ior: np.ndarray) -> np.ndarray:
    """Cosine-weighted average of `grazing_share` over the hemisphere.

    The average of Fresnel's reflectance is the fit of Kulla and Conty, "Revisiting Physically Based Shading at
    Imageworks", 2017; of Schlick's curve it is 1/21.
    """
    into = (ior - 1) / (4.08567 + 1.00071 * ior)
    out_of = 0.997118 + ior * (0.1014 - ior * (0.965241 + ior * 0.130607))
    f0 = normal_reflectance(ior)
    exact = (np.where(ior < 1, out_of, into) - f0) / (1 - f0 + _TINY)
    return np.where(ior > 0, np.clip(exact, 0, 1), _SCHLICK_AVERAGE).astype(np.float32)
