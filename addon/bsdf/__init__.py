"""How a surface scatters light: its lobes sampled, evaluated and weighed against each other, in a local frame."""

from .albedo import base_share, glossy_albedo
from .lobes import ALL, Lobe
from .scattering import (
    PEAK,
    SMOOTH,
    Sample,
    evaluate_glossy,
    evaluate_wide,
    glass_ways,
    is_focused,
    pdf_glossy,
    sample_bsdf,
)
from .surface import Surface, surface_at

__all__ = [
    "ALL",
    "PEAK",
    "SMOOTH",
    "Lobe",
    "Sample",
    "Surface",
    "base_share",
    "evaluate_glossy",
    "evaluate_wide",
    "glass_ways",
    "glossy_albedo",
    "is_focused",
    "pdf_glossy",
    "sample_bsdf",
    "surface_at",
]
