"""Lights: their power, how they emit photons, and how they are sampled from a point."""

from .light_sources import light_sources
from .source import Source, Sphere, region_of

__all__ = ["Source", "Sphere", "light_sources", "region_of"]
