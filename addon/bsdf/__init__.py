"""How a surface scatters light: closures sampled, evaluated and weighed against each other, in a local frame.

A lobe is a file (`diffuse`, `translucent`, `glossy`, `glass`): sample, evaluate, pdf and albedo of one closure.
`mixture` adds the closures of a point up, and `scatter` says what becomes of a ray there; both are parts of kernels.
`arrays` has the mixture's functions for many points at a time.
"""

from ..scene.closures import Lobe
from .arrays import (
    Surface,
    base_transmittance,
    diffuse_albedo,
    evaluate_broad,
    evaluate_glossy,
    glass_albedo,
    glossy_albedo,
    is_mirror,
    pdf_glossy,
    reflects_highlights,
    surface_at,
    translucent_albedo,
)
from .glossy import PEAK, SMOOTH
from .mixture import ALL_LOBES, SPECULAR_LOBES

__all__ = [
    "ALL_LOBES",
    "PEAK",
    "SMOOTH",
    "SPECULAR_LOBES",
    "Lobe",
    "Surface",
    "base_transmittance",
    "diffuse_albedo",
    "evaluate_broad",
    "evaluate_glossy",
    "glass_albedo",
    "glossy_albedo",
    "is_mirror",
    "pdf_glossy",
    "reflects_highlights",
    "surface_at",
    "translucent_albedo",
]
