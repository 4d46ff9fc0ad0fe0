"""Lights: their power, how they emit photons, how points sample them, and what they show along rays."""

from .aiming.regions import Sphere, bounding_sphere, region_of
from .light_sources import light_sources
from .source import Rays, Source

__all__ = ["Rays", "Source", "Sphere", "bounding_sphere", "light_sources", "region_of"]
