"""Real spherical harmonics of two bands: functions over directions as four numbers.

A function f is approximated by c · y(ω), with y = (√(1/4π), √(3/4π) x, √(3/4π) y, √(3/4π) z) and c = ∫ f y dω; the
basis is orthonormal.
"""

import numpy as np

Y0 = np.float32(np.sqrt(1 / (4 * np.pi)))
"""The constant basis function."""

Y1 = np.float32(np.sqrt(3 / (4 * np.pi)))
"""What the linear basis functions are of a direction's components."""


def sh_basis(directions: np.ndarray) -> np.ndarray:
    """y(ω) of unit directions (n, 3): (n, 4) float32."""
    y = np.empty((len(directions), 4), np.float32)
    y[:, 0] = Y0
    np.multiply(directions, Y1, out=y[:, 1:])
    return y


def sh_cosine_lobe(normals: np.ndarray) -> np.ndarray:
    """Coefficients of the clamped cosine (ω · n)⁺ around unit normals (n, 3): (n, 4) float32.

    They are A₀ Y₀ and A₁ Y₁ n, with A₀ = π and A₁ = 2π/3 (Ramamoorthi and Hanrahan 2001), so that the scalar product
    with a radiance's coefficients is its irradiance.
    """
    lobe = sh_basis(normals)
    lobe[:, 0] *= np.float32(np.pi)
    lobe[:, 1:] *= np.float32(2 * np.pi / 3)
    return lobe
