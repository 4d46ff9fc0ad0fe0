"""How a surface scatters light: its lobes sampled, evaluated and weighed against each other, in a local frame."""

from .albedo import base_share, glossy_albedo
from .lobes import ALL, Lobe
from .scattering import SMOOTH, Sample, evaluate_glossy, is_specular, pdf_glossy, sample_bsdf
from .surface import Surface, surface_at

__all__ = [
    "ALL",
    "SMOOTH",
    "Lobe",
    "Sample",
    "Surface",
    "base_share",
    "evaluate_glossy",
    "glossy_albedo",
    "is_specular",
    "pdf_glossy",
    "sample_bsdf",
    "surface_at",
]
