"""Light in flight: how sources emit photons, how surfaces scatter them, and the photons that are stored."""

from .emission import Source, Sphere, light_sources, region_of
from .guiding import GuidedSource, guide_sources, pilots_for
from .photons import PathKind, Photons
from .tracing import emitted_rays, trace_photons

__all__ = [
    "GuidedSource",
    "PathKind",
    "Photons",
    "Source",
    "Sphere",
    "emitted_rays",
    "guide_sources",
    "light_sources",
    "pilots_for",
    "region_of",
    "trace_photons",
]
