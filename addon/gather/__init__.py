"""Photons to irradiance: a final gather into a radiance cache, a density estimate, or a volume of cells."""

from .build_cache import Survey, build_radiance_cache, survey_surfaces
from .camera_gloss import camera_gloss, reflected_direct
from .camera_highlights import reflected_highlights
from .density import LEAST_ESTIMATES, PhotonDensity, search_radius
from .direct_irradiance import direct_irradiance, direct_slope
from .direct_light import DirectLight
from .disc_density import MidAir
from .final import Effort, FinalGather
from .gather_rays import GatherRays
from .glossy_light import glossy_radiance
from .irradiance import Estimate, Irradiance, OwnRays
from .light_volume import Cascade
from .open_sides import OpenBacks
from .photon_volumes import OF_SCATTERED, photon_volume_gloss, photon_volume_irradiance, scatter_light
from .probe_light import ProbeLight, caustics_at_probes, gather_probes
from .radiance_cache import RadianceCache
from .screen_volume import screen_irradiance
from .thinned_density import thinned_density
from .upsampling import upsampled

__all__ = [
    "LEAST_ESTIMATES",
    "OF_SCATTERED",
    "Cascade",
    "DirectLight",
    "Effort",
    "Estimate",
    "FinalGather",
    "GatherRays",
    "Irradiance",
    "MidAir",
    "OpenBacks",
    "OwnRays",
    "PhotonDensity",
    "ProbeLight",
    "RadianceCache",
    "Survey",
    "build_radiance_cache",
    "camera_gloss",
    "caustics_at_probes",
    "direct_irradiance",
    "direct_slope",
    "gather_probes",
    "glossy_radiance",
    "photon_volume_gloss",
    "photon_volume_irradiance",
    "reflected_direct",
    "reflected_highlights",
    "scatter_light",
    "screen_irradiance",
    "search_radius",
    "survey_surfaces",
    "thinned_density",
    "upsampled",
]
