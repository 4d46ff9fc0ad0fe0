"""Photon splatting: each photon lights the points around it, after section 5 of McGuire and Luebke."""

from .gloss import splat_gloss
from .photon_splatting import splat_irradiance
from .radius import OF_SCATTERED, neighbour_radius, path_density_radius
from .splat import LitPoints, Splatted, splat_photons

__all__ = [
    "OF_SCATTERED",
    "LitPoints",
    "Splatted",
    "neighbour_radius",
    "path_density_radius",
    "splat_gloss",
    "splat_irradiance",
    "splat_photons",
]
