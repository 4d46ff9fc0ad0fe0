"""Photons to irradiance: a density estimate, or a final gather into a radiance cache."""

from .build_cache import build_radiance_cache, worthwhile_elements
from .density import density_estimate
from .direct_irradiance import direct_irradiance
from .direct_light import DirectLight
from .final_gather import final_gather
from .gather_rays import GatherRays
from .irradiance import Irradiance
from .radiance_cache import RadianceCache

__all__ = [
    "DirectLight",
    "GatherRays",
    "Irradiance",
    "RadianceCache",
    "build_radiance_cache",
    "density_estimate",
    "direct_irradiance",
    "final_gather",
    "worthwhile_elements",
]
