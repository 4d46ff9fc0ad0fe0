"""How a surface scatters light: closures sampled, evaluated and weighed against each other, in a local frame.

A lobe is a file (`lambertian/diffuse`, `glossy`, `glass`): how one closure is sampled, and where it takes more than its
weight to say so its f, density and albedo.
`mixture` adds the closures of a point up, `albedos` says what they scatter in all, and `scatter` what becomes of a ray
there; these are parts of kernels. `arrays` has those of their functions that array code asks for many points at a time.
"""

from ..scene.closures import Lobe
from .arrays import (
    Surface,
    diffuse_albedo,
    evaluate_glossy,
    glossy_albedo,
    lambertian_normals,
    reflects_highlights,
    surface_at,
    translucent_albedo,
)
from .glossy import PEAK, SMOOTH
from .mixture import ALL_LOBES, NARROW_LOBES

__all__ = [
    "ALL_LOBES",
    "NARROW_LOBES",
    "PEAK",
    "SMOOTH",
    "Lobe",
    "Surface",
    "diffuse_albedo",
    "evaluate_glossy",
    "glossy_albedo",
    "lambertian_normals",
    "reflects_highlights",
    "surface_at",
    "translucent_albedo",
]
