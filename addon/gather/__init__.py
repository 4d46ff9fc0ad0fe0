"""Photons to irradiance: a final gather into a radiance cache, a density estimate, or a volume of cells."""

from .density.density import LEAST_ESTIMATES, PhotonDensity, search_radius
from .density.disc_density import MidAir
from .density.thinned_density import thinned_density
from .direct.direct_irradiance import direct_irradiance, direct_slope
from .direct.direct_light import DirectLight
from .irradiance import Estimate, Irradiance, OwnRays
from .irradiance_cache import FinalGather, SampleBudget
from .light_volume import Cascade
from .light_volume.glossy_light import glossy_radiance
from .mid_air import OpenBacks
from .photon_splatting import OF_SCATTERED, splat_gloss, splat_irradiance, splat_photons
from .photon_splatting.upsampling import upsampled
from .radiance_cache.build import build_radiance_cache
from .radiance_cache.importance_pilot import ImportancePilot, importance_pilot
from .radiance_cache.radiance_cache import RadianceCache
from .rays.camera_gloss import camera_gloss, reflected_direct
from .rays.camera_highlights import reflected_highlights
from .rays.camera_media import scattered_in_media, scattered_in_mirrors
from .rays.gather_rays import GatherRays
from .rays.probe_light import ProbeLight, caustics_at_probes, gather_probes
from .screen_volume.screen_volume import screen_irradiance
from .volume_caustics.photon_points import caustic_points
from .volume_caustics.picture import volume_caustics

__all__ = [
    "LEAST_ESTIMATES",
    "OF_SCATTERED",
    "Cascade",
    "DirectLight",
    "Estimate",
    "FinalGather",
    "GatherRays",
    "ImportancePilot",
    "Irradiance",
    "MidAir",
    "OpenBacks",
    "OwnRays",
    "PhotonDensity",
    "ProbeLight",
    "RadianceCache",
    "SampleBudget",
    "build_radiance_cache",
    "camera_gloss",
    "caustic_points",
    "caustics_at_probes",
    "direct_irradiance",
    "direct_slope",
    "gather_probes",
    "glossy_radiance",
    "importance_pilot",
    "reflected_direct",
    "reflected_highlights",
    "scattered_in_media",
    "scattered_in_mirrors",
    "screen_irradiance",
    "search_radius",
    "splat_gloss",
    "splat_irradiance",
    "splat_photons",
    "thinned_density",
    "upsampled",
    "volume_caustics",
]
