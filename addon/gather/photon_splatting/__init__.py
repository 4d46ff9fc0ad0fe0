"""Photon volumes: each photon lights the points around it, after section 5 of McGuire and Luebke."""

from .gloss import photon_volume_gloss
from .photon_splatting import photon_volume_irradiance
from .radius import OF_SCATTERED, neighbour_radius, path_density_radius
from .splat import Points, Scattered, scatter_light

__all__ = [
    "OF_SCATTERED",
    "Points",
    "Scattered",
    "neighbour_radius",
    "path_density_radius",
    "photon_volume_gloss",
    "photon_volume_irradiance",
    "scatter_light",
]
