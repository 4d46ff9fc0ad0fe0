"""Light in flight: how photons fly, how surfaces scatter them, and the photons that are stored."""

from .bounce_map import BounceMap, bounce_map
from .emission import emitted_rays
from .flights import FlightLog, Flights
from .guiding import GuidedSource, guide_sources, noise_of_photons, pilots_for
from .photons import PathKind, Photons
from .tracing import bounces_left, trace_photons

__all__ = [
    "BounceMap",
    "FlightLog",
    "Flights",
    "GuidedSource",
    "PathKind",
    "Photons",
    "bounce_map",
    "bounces_left",
    "emitted_rays",
    "guide_sources",
    "noise_of_photons",
    "pilots_for",
    "trace_photons",
]
