"""Cases, one feature each: small scenes with probes, for which Cycles' mean light stands in tests/references."""

from . import emitters, lamp_nodes, lamps, light_visibility, media, motion, shapes, surfaces, textures
from .registry import CASES, GROUPS, Case

__all__ = [
    "CASES",
    "GROUPS",
    "Case",
    "emitters",
    "lamp_nodes",
    "lamps",
    "light_visibility",
    "media",
    "motion",
    "shapes",
    "surfaces",
    "textures",
]
