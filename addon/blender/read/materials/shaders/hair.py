"""Hair shaders on meshes, as surfaces: what a fibre sends back is reflected diffusely, what passes it is transmitted.

Cycles shades a mesh like a fibre along its v (of Principled Hair, its u) direction. Here the shares of the light are
those of the fibre, averaged over directions by their cosine with the surface; its highlights are lost.
"""

from typing import TYPE_CHECKING

import numpy as np

from .....scene import Lobe
from ..node_math import dielectric_reflectance, saturate
from ..sums import ShaderSum

if TYPE_CHECKING:
    from ..closures import Leaf

EUMELANIN, PHEOMELANIN = np.array([[0.506, 0.841, 1.653], [0.343, 0.733, 1.924]], np.float32)
"""Absorption by concentration of pigments (d'Eon et al. 2011, as Cycles scales it)."""

_N = 16


def add_hair(leaf: "Leaf", total: ShaderSum) -> None:
    """A Hair BSDF: one lobe, to either side, that loses nothing."""
    through = leaf.closure.node.component == "Transmission"
    total.add(Lobe.TRANSLUCENT if through else Lobe.DIFFUSE, leaf.weighted)


def add_principled_hair(leaf: "Leaf", total: ShaderSum) -> None:
    """A Principled Hair BSDF."""
    reflected, transmitted = _shares(_absorption(leaf), max(float(leaf["IOR"].mean()), 1.0))
    total.add(Lobe.DIFFUSE, leaf.weight * reflected)
    total.add(Lobe.TRANSLUCENT, leaf.weight * transmitted)


def _absorption(leaf: "Leaf") -> np.ndarray:
    """The coefficient σ inside a fibre, a unit of its radius, (h, w, 3)."""
    node = leaf.closure.node
    if node.parametrization == "ABSORPTION":
        return np.maximum(leaf["Absorption Coefficient"], 0)
    roughness = leaf["Roughness" if node.model == "HUANG" else "Radial Roughness"]
    if node.parametrization == "COLOR":
        return _absorption_of(leaf["Color"], roughness)
    melanin, redness = -np.log(np.maximum(1 - leaf["Melanin"], 1e-4)), leaf["Melanin Redness"]
    return melanin * ((1 - redness) * EUMELANIN + redness * PHEOMELANIN) + _absorption_of(leaf["Tint"], roughness)


def _absorption_of(color: np.ndarray, roughness: np.ndarray) -> np.ndarray:
    """σ by the colour of a mass of hair (Chiang et al. 2016, section 4.2)."""
    scale = np.polyval([0.245, 5.574, -10.73, 2.532, -0.215, 5.969], roughness)
    return (np.log(np.clip(color, 1e-4, 1)) / scale) ** 2


def _shares(absorption: np.ndarray, ior: float) -> tuple[np.ndarray, np.ndarray]:
    """What a fibre reflects (R, TRT and half of the rest) and what it lets through (TT and the other half)."""
    radius, turn = np.sqrt((np.arange(_N) + 0.5) / _N), 2 * np.pi * (np.arange(_N) + 0.5) / _N
    along, across = (np.outer(radius, f(turn)).ravel() for f in (np.cos, np.sin))
    up = np.sqrt(np.maximum(1 - along**2 - across**2, 0))
    cos_o = np.sqrt(1 - along**2)  # of the longitudinal angle; h is the sine of the azimuthal one
    h = across / np.hypot(across, up)
    inside = h * cos_o / np.sqrt(ior**2 - along**2)
    way = 2 * np.sqrt(1 - inside**2) / np.sqrt(1 - (along / ior) ** 2)
    fresnel = dielectric_reflectance(cos_o * np.sqrt(1 - h**2), ior)
    reflected, transmitted = np.zeros_like(absorption), np.zeros_like(absorption)
    for f, length in zip(fresnel, way, strict=True):
        passes = np.exp(-absorption * length)
        once = (1 - f) ** 2 * passes
        twice = once * passes * f
        rest = twice * passes * f / (1 - passes * f)
        reflected, transmitted = reflected + f + twice + rest / 2, transmitted + once + rest / 2
    return saturate(reflected / len(way)).astype(np.float32), saturate(transmitted / len(way)).astype(np.float32)
