"""Light in flight: how sources emit photons, how surfaces scatter them, and the photons that are stored."""

from .emission import Source, Sphere, light_sources, region_of
from .photons import PathKind, Photons
from .tracing import emitted_rays, trace_photons

__all__ = ["PathKind", "Photons", "Source", "Sphere", "emitted_rays", "light_sources", "region_of", "trace_photons"]
