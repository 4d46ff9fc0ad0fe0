"""Phase functions of particles of all sizes, by the versine v = 1 − cos θ, and tables of them that kernels take.

Rayleigh's, of particles far smaller than the wavelength; Draine's [1], between that and Henyey and Greenstein's;
Fournier and Forand's [2], of particles in water; and that of droplets by Mie's theory, as fitted in [3].

[1] B. T. Draine, Scattering by interstellar dust grains. Astrophysical Journal 598 (2003).
[2] G. Fournier, M. Jonasz, Computer-based underwater imaging analysis. Proc. SPIE 3761 (1999).
[3] J. Jendersie, E. d'Eon, An approximate Mie scattering function for fog and cloud rendering. SIGGRAPH Talks (2023).
"""

from collections.abc import Callable

import numpy as np

from .sampling import N_RINGS

PhaseFunction = Callable[[np.ndarray], np.ndarray]
"""Density by solid angle, 1/sr, of versines."""

_LEAST_VERSINE, _N_STEPS = 1e-12, 1 << 15
_CLOSE_TO_ONE = 1e-3  # δ of Fournier and Forand's, about which its quotients are 0/0


def draine(g: float, alpha: float = 0.0) -> PhaseFunction:
    """Draine's: Henyey and Greenstein's with α = 0, Rayleigh's with g = 0 and α = 1."""
    scale = (1 - g * g) / (4 * np.pi * (1 + alpha * (1 + 2 * g * g) / 3))
    return lambda v: scale * (1 + alpha * (1 - v) ** 2) / ((1 - g) ** 2 + 2 * g * v) ** 1.5


def rayleigh() -> PhaseFunction:
    """Of particles far smaller than the wavelength, 3 (1 + cos² θ) / (16π)."""
    return draine(0, 1)


def fournier_forand(ior: float, backscatter: float) -> PhaseFunction:
    """Of particles with an index of refraction, in water, that scatter a share of the light back (θ > 90°)."""
    ior, backscatter = max(ior, 1 + 1e-3), min(abs(backscatter), 0.5 - 1e-3)
    per_square = 4 / (3 * (ior - 1) ** 2)  # δ = 4 sin²(θ/2) / (3 (n − 1)²)
    nu = -np.log(2 * backscatter * (per_square / 2 - 1) + 1) / np.log(per_square / 2)
    behind = (per_square**-nu - 1) / (16 * np.pi * (per_square - 1))

    def density(v: np.ndarray) -> np.ndarray:
        square = np.maximum(v / 2, _LEAST_VERSINE / 2)  # sin²(θ/2)
        delta = per_square * square
        delta = np.where(np.abs(1 - delta) < _CLOSE_TO_ONE, 1 + _CLOSE_TO_ONE, delta)
        power, rest = delta**nu, 1 - delta
        front = nu * rest - (1 - power) + (delta * (1 - power) - nu * rest) / square
        return front / (4 * np.pi * rest**2 * power) + behind * (3 * (1 - v) ** 2 - 1)

    return density


def mie(diameter: float) -> PhaseFunction:
    """Of droplets of water in air, by their diameter in µm: a mixture of Henyey and Greenstein's with Draine's."""
    g_hg, g_d, alpha, w = _mie_parameters(max(diameter, 1e-3))
    narrow, broad = draine(g_hg), draine(g_d, alpha)
    return lambda v: (1 - w) * narrow(v) + w * broad(v)


def _mie_parameters(d: float) -> tuple[float, float, float, float]:
    """By the diameter [3]: g of Henyey and Greenstein's part, g and α of Draine's, and that part's share."""
    log = np.log(d)
    if d <= 0.1:
        return 13.8 * d * d, 1.1456 * d * np.sin(9.29044 * d), 250.0, 0.252977 - 312.983 * d**4.3
    if d < 1.5:
        inner = np.cos((log - 0.238604) * (log + 1.00667) / (0.507522 - 0.15677 * log))
        g_d = 0.379685 * np.cos(1.19692 * inner + 1.37932 * log + 0.0625835) + 0.344213
        w = 0.146209 * np.cos(3.38707 * log + 2.11193) + 0.316072 + 0.0778917 * log
        return 0.862 - 0.143 * log * log, g_d, 250.0, w
    if d < 5:
        g_d = 0.500411 - 0.081287 / (-2 * log + np.tan(log) + 1.27551)
        w = 0.026914 * (log - np.cos(5.68947 * (np.log(log) - 0.0292149))) + 0.376475
        return 0.0604931 * np.log(log) + 0.940256, g_d, 7.30354 * log + 6.31675, w
    g_hg, g_d = np.exp(-0.0990567 / (d - 1.67154)), np.exp(-2.20679 / (d + 3.91029) - 0.428934)
    return g_hg, g_d, np.exp(3.62489 - 8.29288 / (d + 5.52825)), np.exp(-0.599085 / (d - 0.641583) - 0.665888)


def rings_of(function: PhaseFunction) -> np.ndarray:
    """The table of a phase function: versines of equal steps of its cumulative distribution, (N_RINGS + 1,) float32."""
    versines = np.concatenate([[0], np.geomspace(_LEAST_VERSINE, 2, _N_STEPS)])
    density = np.maximum(function(versines), 0)
    steps = (density[1:] + density[:-1]) / 2 * np.diff(versines)
    cumulative = np.concatenate([[0], np.cumsum(steps)])
    rings = np.interp(np.linspace(0, cumulative[-1], N_RINGS + 1), cumulative, versines)
    return rings.astype(np.float32)
