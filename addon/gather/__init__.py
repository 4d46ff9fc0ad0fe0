"""Photons to irradiance: a final gather into a radiance cache, a density estimate, or a volume of cells."""

from .build_cache import build_radiance_cache, worthwhile_elements
from .density import Density, density_estimate
from .direct_irradiance import direct_irradiance
from .direct_light import DirectLight
from .final_gather import final_gather
from .gather_rays import GatherRays
from .glossy_light import glossy_radiance
from .irradiance import Irradiance
from .light_volume import Cascade
from .radiance_cache import RadianceCache
from .screen_volume import screen_irradiance

__all__ = [
    "Cascade",
    "Density",
    "DirectLight",
    "GatherRays",
    "Irradiance",
    "RadianceCache",
    "build_radiance_cache",
    "density_estimate",
    "direct_irradiance",
    "final_gather",
    "glossy_radiance",
    "screen_irradiance",
    "worthwhile_elements",
]
