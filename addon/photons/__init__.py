"""Light in flight: how sources emit photons, how surfaces scatter them, and the photons that are stored."""

from .bounce_map import BounceMap, bounce_map
from .emission import light_sources
from .flights import FlightLog, Flights
from .guiding import GuidedSource, guide_sources, noise_of_photons, pilots_for
from .photons import PathKind, Photons
from .source import Source, Sphere, region_of
from .tracing import bounces_left, emitted_rays, trace_photons

__all__ = [
    "BounceMap",
    "FlightLog",
    "Flights",
    "GuidedSource",
    "PathKind",
    "Photons",
    "Source",
    "Sphere",
    "bounce_map",
    "bounces_left",
    "emitted_rays",
    "guide_sources",
    "light_sources",
    "noise_of_photons",
    "pilots_for",
    "region_of",
    "trace_photons",
]
