"""Rays traced through cube maps instead of triangles (Fei and Wang, section 3).

A handful of small pictures of the scene, each taken in all directions from a point, stand for its surfaces. On a
graphics card this needs no tree; the kernels here read as those of a graphics card do, which are tested against them.
"""

from .cube_maps import CubeMaps
from .placement import lit_region
from .search.segments import LightRays
from .search.statistics import Statistics
from .tracer import MultiImageTracer

__all__ = ["CubeMaps", "LightRays", "MultiImageTracer", "Statistics", "lit_region"]
