"""Light in flight: how sources emit photons, how surfaces scatter them, and the photons that are stored."""

from .bounce_map import BounceMap, bounce_map
from .emission import light_sources
from .guiding import GuidedSource, guide_sources, pilots_for
from .photons import PathKind, Photons
from .source import Source, Sphere, region_of
from .tracing import emitted_rays, trace_photons

__all__ = [
    "BounceMap",
    "GuidedSource",
    "PathKind",
    "Photons",
    "Source",
    "Sphere",
    "bounce_map",
    "emitted_rays",
    "guide_sources",
    "light_sources",
    "pilots_for",
    "region_of",
    "trace_photons",
]
