"""Lights: their power, how they emit photons, how points sample them, and what they show along rays."""

from .light_sources import light_sources
from .regions import Sphere, bounding_sphere, region_of
from .source import Rays, Source

__all__ = ["Rays", "Source", "Sphere", "bounding_sphere", "light_sources", "region_of"]
