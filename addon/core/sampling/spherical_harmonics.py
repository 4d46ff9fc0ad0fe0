"""Real spherical harmonics of two or three bands: functions over directions as 4 or 9 numbers.

A function f is approximated by c · y(ω) with c = ∫ f y dω; the basis is orthonormal:

    y = (√(1/4π), √(3/4π) x, √(3/4π) y, √(3/4π) z,
         √(15/4π) xy, √(15/4π) yz, √(5/16π) (3z² − 1), √(15/4π) xz, √(15/16π) (x² − y²))
"""

import numpy as np

Y0 = np.float32(np.sqrt(1 / (4 * np.pi)))
"""The constant basis function."""

Y1 = np.float32(np.sqrt(3 / (4 * np.pi)))
"""What the linear basis functions are of a direction's components."""

Y2 = np.sqrt(np.array([15 / 4, 15 / 4, 5 / 16, 15 / 4, 15 / 16]) / np.pi).astype(np.float32)
"""What the basis functions of the third band are of xy, yz, 3z² − 1, xz and x² − y²."""

COSINE_LOBE = np.pi * np.array([1, *3 * [2 / 3], *5 * [1 / 4]], np.float32)
"""A of each basis function: by it the clamped cosine turns radiance into irradiance (Ramamoorthi and Hanrahan 2001)."""


def sh_basis(directions: np.ndarray, n_bands: int = 2) -> np.ndarray:
    """y(ω) of unit directions (n, 3): (n, n_bands²) float32, for two or three bands."""
    basis = np.empty((len(directions), n_bands**2), np.float32)
    basis[:, 0] = Y0
    np.multiply(directions, Y1, out=basis[:, 1:4])
    if n_bands > 2:
        x, y, z = np.asarray(directions, np.float32).T
        basis[:, 4:] = np.stack([x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y], axis=1) * Y2
    return basis


def sh_cosine_lobe(normals: np.ndarray, n_bands: int = 2) -> np.ndarray:
    """Coefficients of the clamped cosine (ω · n)⁺ around unit normals (n, 3): (n, n_bands²) float32.

    The scalar product with a radiance's coefficients is its irradiance.
    """
    return sh_basis(normals, n_bands) * COSINE_LOBE[: n_bands**2]


def turned_harmonics(rotation: np.ndarray, n_bands: int) -> np.ndarray:
    """The matrix (n_bands², n_bands²) that takes coefficients of f to those of f(R⁻¹ω), for a rotation R (3, 3)."""
    directions = np.random.default_rng(0).standard_normal((32, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    of_turned = sh_basis(directions @ rotation, n_bands).astype(np.float64)
    turned: np.ndarray = np.linalg.lstsq(sh_basis(directions, n_bands).astype(np.float64), of_turned, rcond=None)[0]
    return turned
