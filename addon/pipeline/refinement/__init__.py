"""Meshes whose faces are cut until light is linear between their vertices (Kristensen and Ottosen, section 5.4.1).

Triangles are split at their longest edges (`triangles`), those first whose light is furthest from what their corners
say of it (`samples`), in rounds that gather the light of all new vertices at once (`rounds`). What comes out is a list
of splits, which Blender's side carries out on stored meshes. `coarse` finds the meshes that need it in a bake's light.
"""

from .coarse import COARSE, WIDEST, WidePoints
from .rounds import BUDGET, TOLERANCE, Refinement, RefineOptions, refine
from .triangles import Placed, Triangles

__all__ = [
    "BUDGET",
    "COARSE",
    "TOLERANCE",
    "WIDEST",
    "Placed",
    "RefineOptions",
    "Refinement",
    "Triangles",
    "WidePoints",
    "refine",
]
