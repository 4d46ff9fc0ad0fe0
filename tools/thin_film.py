"""Tabulate how eyes see interference, and write it to addon/bsdf/facets/thin_film.npz: `python tools/thin_film.py`.

Print its digest, which addon/bsdf/facets/thin_film.py has to say.
"""

import hashlib
from pathlib import Path

import numpy as np
from photon_bake.addon.bsdf.facets import thin_film
from scipy.interpolate import CubicSpline

CURVES = Path(__file__).with_name("cie_1931.csv")
TO_REC_709 = np.array(
    [
        [3.2404542, -1.5371385, -0.4985314],
        [-0.9692660, 1.8760108, 0.0415560],
        [0.0556434, -0.2040259, 1.0572252],
    ]
)
_GAUSSIANS = (
    # XYZ of each, weight, centre in 1/m, variance in 1/m²: Belcour and Barla's fit
    (0, 5.4856e-13, 1.6810e6, 4.3278e9),
    (1, 4.4201e-13, 1.7953e6, 9.3046e9),
    (2, 5.2481e-13, 2.2084e6, 6.6121e9),
    (0, 1.64408e-8 / np.sqrt(2 * np.pi * 4.5282e9), 2.2399e6, 4.5282e9),
)
_OF_WHITE = 1.0685e-7


def response() -> np.ndarray:
    """Both tables, see `thin_film.RESPONSE`."""
    return np.stack([_by_gaussians(), _by_curves()]).astype(np.float32)


def _by_curves() -> np.ndarray:
    """Fourier transforms of Rec.709's colour matching functions of 1/wavelength, over that at 0: Blender 5."""
    table = np.loadtxt(CURVES, delimiter=",")
    curves = CubicSpline(table[:, 0], table[:, 1:], extrapolate=False)
    n = 2 * (thin_film.N_NODES - 1)
    frequencies = np.arange(n) / (n * thin_film.STEP)  # 1/nm
    with np.errstate(divide="ignore", invalid="ignore"):
        sampled = np.nan_to_num(curves(1 / frequencies) / frequencies[:, None] ** 2, posinf=0)
    transform = np.fft.rfft(sampled, axis=0) @ TO_REC_709.T
    transform /= transform[0].real
    return np.stack([transform.real, transform.imag], axis=1).T


def _by_gaussians() -> np.ndarray:
    """The same of a fit by four Gaussians in XYZ, with Rec.709's white: Blender 4.5."""
    phase = 2 * np.pi * np.arange(thin_film.N_NODES) * thin_film.STEP * 1e-9
    xyz = np.zeros((3, thin_film.N_NODES), complex)
    for axis, weight, centre, variance in _GAUSSIANS:
        height = weight * np.sqrt(2 * np.pi * variance) / _OF_WHITE
        xyz[axis] += height * np.exp(-1j * centre * phase - variance * phase**2)
    white = np.linalg.inv(TO_REC_709).sum(axis=1)
    transform = TO_REC_709 @ (white[:, None] * xyz)
    return np.stack([transform.real, transform.imag], axis=1)


if __name__ == "__main__":
    np.savez(thin_film.FILE, response=response())
    print(hashlib.sha256(thin_film.FILE.read_bytes()).hexdigest())
