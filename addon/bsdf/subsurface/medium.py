"""The medium inside of a body, by the colour that its surface is to have and by the mean free path.

The single-scattering albedo α that makes a half-space of the colour A is found by one of two inversions:

- d'Eon, "A Hitchhiker's Guide to Multiple Scattering", v0.3.2, equation 53.7, for any anisotropy g by van de Hulst's
  similarity:  s = 4.09712 + 4.20863 A − √(9.59217 + 41.6808 A + 17.7126 A²),  α = (1 − s²)/(1 − g s²).
- The fit of Chiang, Kutz and Burley, "Practical and Controllable Subsurface Scattering for Production Path Tracing",
  2016, for g by Wrenninge, Villemin and Hery, whose free path is that of isotropic scattering: σt = 1/((1 − g) d).
"""

from typing import NamedTuple

import numpy as np

from ...core.compiling import part, routine
from ...core.vec3 import ONE, ZERO, row
from ...scene.hit import channel_at

_MOST_ALBEDO, _LEAST_ALBEDO = np.float32(0.999999), np.float32(0.2)
_LEAST_PATH, _TINY, _HALF, _QUARTER = np.float32(1e-16), np.float32(1e-8), np.float32(0.5), np.float32(0.25)

# Of α = (1 − A^¼) a atan(b A)^c + A^¼ d atan(e A)^f: polynomials of g, from the constant on; b and e are p + q exp(…)
_A = 1.8260523782, -1.28451056436, -1.79904629312, 9.19393289202, -22.8215585862, 32.0234874259, -23.6264803333
_A_7 = 7.21067002658
_B = 0.0, 31.1491581433, -201.847017512, 841.576016723, -2018.09288505, 2731.71560286, -1935.41424244
_B_7, _B_SCALE, _B_BASE = 559.009054474, 0.127355959438, 4.98511194385
_C = 1.09686102424, -0.394704063468, 1.05258115941, -8.83963712726, 28.8643230661, -46.8802913581, 38.5402837518
_C_7 = -12.7181042538
_D = 0.496310210422, 0.360146581622, -2.15139309747, 17.8896899217, -55.2984010333, 82.065982243, -58.5106008578
_D_7 = 15.8478295021
_E = 0.0, 76.7316253952, -594.356773233, 2448.8834203, -5576.68528998, 7116.60171912, -4763.54467887
_E_7, _E_SCALE, _E_BASE = 1303.5318055, 0.00310603949088, 4.23190299701
_F = 2.40602999408, -2.51814844609, 9.18494908356, -79.2191708682, 259.082868209, -403.613804597, 302.85712436
_F_7 = -87.4370473567


class Medium(NamedTuple):
    """What a walk goes through.

    Attributes
    ----------
    extinction : triple, 1/m
        σt.
    albedo : triple
        α, of a single scattering.
    anisotropy : float32
        Mean cosine g of Henyey and Greenstein's phase function.
    weight : triple
        What a walk starts with: 1 over the colour A, which the closure's weight has in it; less where α had to be
        raised.
    roughness, ior : float32
        α of the facets through which views and light pass, and the index of refraction inside of them.
    spread : float32
        Share of the light that enters by a cosine instead.
    """

    extinction: tuple
    albedo: tuple
    anisotropy: np.float32
    weight: tuple
    roughness: np.float32
    ior: np.float32
    spread: np.float32


@routine
def medium_at(scene, k, triangle, u, v):
    """The medium of the k-th closure of the scene, at a point of a triangle."""
    closures, at = scene.materials.closures, (triangle, u, v)
    color, path = channel_at(scene, closures.f0, k, *at), channel_at(scene, closures.f90, k, *at)
    roughness, (g, spread, fitted) = channel_at(scene, closures.roughness, k, *at)[0], row(closures.edge.value, k)
    return _medium(color, path, g, roughness * roughness, closures.ior[k], spread, fitted > _HALF)


@part
def _medium(color, path, g, roughness, ior, spread, fitted):
    """The medium of a colour and a mean free path (m), by one inversion or by the other."""
    r, g_, b = (
        _channel(color[0], path[0], g, fitted),
        _channel(color[1], path[1], g, fitted),
        _channel(color[2], path[2], g, fitted),
    )
    extinction, albedo, weight = (r[0], g_[0], b[0]), (r[1], g_[1], b[1]), (r[2], g_[2], b[2])
    return Medium(extinction, albedo, g, weight, roughness, ior, spread)


@part
def _channel(color, path, g, fitted):
    """σt, α and the weight of one channel."""
    albedo, extinction = albedo_of(color, g, fitted), ONE / max(path, _LEAST_PATH)
    if fitted:
        extinction /= ONE - g
    weight = ONE / color if color > _TINY else ZERO
    if albedo < _LEAST_ALBEDO:  # phase functions and paths stay finite
        weight, albedo = weight * albedo / _LEAST_ALBEDO, _LEAST_ALBEDO
    return extinction, albedo, weight


@routine
def albedo_of(color, g, fitted):
    """The single-scattering albedo that makes a half-space of a colour."""
    if fitted:
        albedo = _fit(np.float64(color), np.float64(g))
    else:
        a = np.float64(color)
        s = 4.09712 + 4.20863 * a - np.sqrt(9.59217 + 41.6808 * a + 17.7126 * a * a)
        albedo = (1.0 - s * s) / (1.0 - np.float64(g) * s * s)
    return min(max(np.float32(albedo), ZERO), _MOST_ALBEDO)


@part
def _fit(color, g):
    a, c = _power_series(_A, _A_7, g), _power_series(_C, _C_7, g)
    d, f = _power_series(_D, _D_7, g), _power_series(_F, _F_7, g)
    b = _B_BASE + _B_SCALE * np.exp(_power_series(_B, _B_7, g))
    e = _E_BASE + _E_SCALE * np.exp(_power_series(_E, _E_7, g))
    blend = max(color, 0.0) ** 0.25
    return (1.0 - blend) * a * np.arctan(b * color) ** c + blend * d * np.arctan(e * color) ** f


@part
def _power_series(low, last, g):
    total = last
    for k in range(len(low)):
        total = total * g + low[len(low) - 1 - k]
    return total
