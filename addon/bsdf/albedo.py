"""What each lobe of a surface reflects in all, and how lobes share the light between them.

`cos` is always the cosine at which the *viewing* side sees the surface, (n,) float32 in (0, 1].
"""

import numpy as np

from . import albedo_tables as tables
from .fresnel import average_grazing_share
from .surface import Surface


def base_share(surface: Surface, cos: np.ndarray) -> np.ndarray:
    """Share of the light that the dielectric layer leaves to the diffuse lobe, (n,): 1 − the layer's albedo.

    The layer is a glossy lobe of its own, f0 = `layer_f0` and f90 = 1. As Cycles has it, its albedo is that of its
    facets, times what multiple scattering makes of the white lobe's albedo where energy is preserved; where it is not,
    what the facets shadow is taken from the diffuse lobe as well.
    """
    share = np.ones(len(cos), np.float32)
    k = np.flatnonzero(surface.layer_f0 > 0)
    if len(k) == 0:
        return share
    f0, roughness, ior, cos = surface.layer_f0[k], surface.roughness[k], surface.fresnel_ior[k], cos[k]
    grazing = tables.interpolate(tables.grazing()[1], tables.curve_coordinate(ior), roughness, cos)
    albedo = f0 + (1 - f0) * grazing
    average = f0 + (1 - f0) * average_grazing_share(ior)
    white = tables.interpolate(tables.white(), roughness, cos)
    energy = white * _multiple_scattering(average, white, tables.interpolate(tables.white_average(), roughness))
    share[k] = np.clip(1 - albedo * np.where(surface.preserves_energy[k], energy, 1), 0, 1)
    return share


def glossy_albedo(surface: Surface, cos: np.ndarray) -> np.ndarray:
    """Directional albedo of the glossy lobe, (n, 3)."""
    if not (surface.f0.any() or surface.f90.any()):
        return np.zeros_like(surface.f0)
    white = tables.interpolate(tables.white(), surface.roughness, cos)[:, None]
    curve = tables.curve_coordinate(surface.fresnel_ior)
    grazing = tables.interpolate(tables.grazing()[0], curve, surface.roughness, cos)[:, None]
    return (surface.f0 * (white - grazing) + surface.f90 * grazing) * _glossy_scale(surface, white)


def glossy_scale(surface: Surface, cos: np.ndarray) -> np.ndarray:
    """What multiple scattering multiplies the glossy lobe by, (n, 3); 1 where energy is not preserved.

    The lobe that would be white becomes so, and each further reflection between facets takes its colour: Kulla and
    Conty 2017, appendix.
    """
    return _glossy_scale(surface, tables.interpolate(tables.white(), surface.roughness, cos)[:, None])


def _glossy_scale(surface: Surface, white: np.ndarray) -> np.ndarray:
    if not surface.preserves_energy.any():
        return np.ones_like(surface.f0)
    average = surface.f0 + (surface.f90 - surface.f0) * average_grazing_share(surface.fresnel_ior)[:, None]
    white_average = tables.interpolate(tables.white_average(), surface.roughness)[:, None]
    scale = _multiple_scattering(average, white, white_average)
    return np.where(surface.preserves_energy[:, None], scale, np.float32(1))


def glass_scale(surface: Surface, cos: np.ndarray, ior: np.ndarray) -> np.ndarray:
    """What multiple scattering multiplies the glass lobe by, (n, 3); as Cycles has it, its colour is what transmits.

    Parameters
    ----------
    ior : (n,) float32
        Index of refraction beyond the surface over that of the viewing side.
    """
    preserves = surface.preserves_energy & surface.glass_fresnel
    if not preserves.any():
        return np.ones_like(surface.glass_transmission)
    z = (1 + tables.ior_coordinate(ior)) / 2
    white = tables.interpolate(tables.glass(), z, surface.roughness, cos)[:, None]
    white_average = tables.interpolate(tables.glass_average(), z, surface.roughness)[:, None]
    scale = _multiple_scattering(surface.glass_transmission, white, white_average)
    return np.where(preserves[:, None], scale, np.float32(1))


def _multiple_scattering(fresnel: np.ndarray, white: np.ndarray, white_average: np.ndarray) -> np.ndarray:
    """1 + Fms (1 − E)/E with Fms = Fss Eavg / (1 − Fss (1 − Eavg)), Fss the lobe's average reflectance."""
    missing = (1 - white) / white
    return 1 + fresnel * (white_average * missing) / (1 - fresnel * (1 - white_average))
