"""Light in cells, and what makes its level absolute: photons and known light treated alike.

A photon adds its power Φ, from the direction −Θ that it came from, to the cell that it lies in (Fei and Wang, Eq. 5):

    c = Σ Φ y(−Θ)

Equation 4's factor A C₀²/(4N) stands for the area that a photon lights, and drops n's cosine into its power. Here
nothing is estimated: if the radiance in front of the cell's surfaces is L · y(ω), the photons' sum is expected to be

    c = ∫ dA ∫ (ω·n)⁺ (L · y(ω)) y(ω) dω = R L,        R = ∫ r(n) dA,     r(n) = ∫ (ω·n)⁺ y(ω) y(ω)ᵀ dω,

with R, the *response*, known from the surfaces alone. R is put into the cells beside c as four fields (its columns are
what four known radiances would give). What is linear is done to both, and L = R⁻¹ c has its absolute level whatever
that was.
"""

import numpy as np

from ...core.sampling.spherical_harmonics import sh_basis
from ...core.sampling.streams import stream
from ...photons import Photons

N_SIGNS = 2
"""Fields whose photons have random signs: what they read is noise, and as large as that of the light."""

N_LIGHT = 3 + N_SIGNS
N_FIELDS = N_LIGHT + 4
"""Red, green, blue; the signed fields; the response's columns."""

PRIOR = 0.05
"""What speaks against light that comes more from one side than another: this share of the response's trace."""

# r(n) of ν = (1, n): r_ab = SCALE_ab ν_a ν_b, and ISOTROPIC more
SCALE = np.full((4, 4), 3 / 16, np.float32)
SCALE[0, :] = SCALE[:, 0] = 1 / (2 * np.sqrt(3))
SCALE[0, 0] = 1 / 4
ISOTROPIC = np.diag(np.array([0, 3 / 16, 3 / 16, 3 / 16], np.float32))


def sh_response(normals: np.ndarray) -> np.ndarray:
    """r(n) = ∫ (ω·n)⁺ y(ω) y(ω)ᵀ dω of unit normals (n, 3): (n, 4, 4) float32."""
    nu = np.concatenate([np.ones((len(normals), 1), np.float32), normals], axis=1)
    return SCALE * nu[:, :, None] * nu[:, None, :] + ISOTROPIC


def random_signs(photons: Photons, seed: int, *key: int) -> np.ndarray:
    """Signs of emitted photons, ±1: (paths, N_SIGNS) int8, to be looked up by a photon's path."""
    n_paths = int(photons.path.max(initial=-1)) + 1
    return stream(seed, *key).choice(np.array([-1, 1], np.int8), (n_paths, N_SIGNS))


def light_fields(power: np.ndarray, came_from: np.ndarray, signs: np.ndarray) -> np.ndarray:
    """What photons add to the fields of their cells: (N_LIGHT, 4, n) float32, W.

    The signed fields have the power's mean over colours.

    Parameters
    ----------
    power : (n, 3) float32, W
    came_from : (n, 3) float32
        Unit directions −Θ against their flight.
    signs : (n, N_SIGNS) int8
        ±1.
    """
    signed = power.mean(axis=1, keepdims=True) * signs
    return np.concatenate([power, signed], axis=1).T[:, None] * sh_basis(came_from).T


def solve_radiance(fields: np.ndarray) -> np.ndarray:
    """Radiance L from R L = c.

    The prior is added to R for the linear band alone, which stays small where the surfaces around say nothing of it:
    light that is the same from everywhere, and irradiance at the normal of the only surface around (the first row of R
    times L, up to a factor), are exact whatever the prior.

    Parameters
    ----------
    fields : (n, N_FIELDS, 4) float32
        Light (W) and the response's columns (m²).

    Returns
    -------
    (n, N_LIGHT, 4) float32, W/(m² sr)
        Coefficients of red, green, blue and the signed fields; 0 where the response is.
    """
    response = fields[:, N_LIGHT:].transpose(0, 2, 1).astype(np.float64)
    trace = np.trace(response, axis1=1, axis2=2)
    response += trace[:, None, None] * np.diag([0, PRIOR, PRIOR, PRIOR])
    response[trace <= 0] = np.eye(4)
    light = fields[:, :N_LIGHT].transpose(0, 2, 1) * (trace > 0)[:, None, None]
    return np.linalg.solve(response, light).transpose(0, 2, 1).astype(np.float32)
