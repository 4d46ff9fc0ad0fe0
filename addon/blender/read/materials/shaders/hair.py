"""Hair shaders: fibres on hair; on meshes, surfaces that reflect diffusely what fibres send back and transmit the rest.

Cycles shades a mesh like a fibre along its v (of Principled Hair, its u) direction. Here the shares of the light are
those of the fibre, averaged over directions by their cosine with the surface; its highlights are lost.
"""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from .....scene import FibreModel, Lobe
from ..node_math import dielectric_reflectance, saturate
from ..sums import ShaderSum, Term, white

if TYPE_CHECKING:
    from ..closures import Leaf

EUMELANIN, PHEOMELANIN = np.array([[0.506, 0.841, 1.653], [0.343, 0.733, 1.924]], np.float32)
"""Absorption by concentration of pigments (d'Eon et al. 2011, as Cycles scales it)."""

HAIR = {"BSDF_HAIR", "BSDF_HAIR_PRINCIPLED"}
"""Types of the nodes."""

ALONG = np.array([[[1.0001, 0, 0]]], np.float32)
"""The stretch of a fibre: other than 1, so that its frame follows the tangent."""

_N = 16
_LEAST = 1e-3


def add_hair(leaf: "Leaf", total: ShaderSum) -> None:
    """A Hair BSDF: one lobe, to either side, that loses nothing."""
    node = leaf.closure.node
    model = FibreModel.TRANSMISSION if node.component == "Transmission" else FibreModel.REFLECTION
    along, around = (np.clip(leaf[name], _LEAST, 1) for name in ("RoughnessU", "RoughnessV"))
    width = _row(around, leaf["Offset"], around)
    total.add(Lobe.FIBRE, leaf.weighted, f90=width, roughness=along, distribution=model, stretch=ALONG, under=leaf.over)


def add_principled_hair(leaf: "Leaf", total: ShaderSum) -> None:
    """A Principled Hair BSDF; Huang's model as Chiang's of its roughness."""
    huang = leaf.closure.node.model == "HUANG"
    along = np.clip(leaf["Roughness"], _LEAST, 1)
    around = along if huang else np.clip(leaf["Radial Roughness"], _LEAST, 1)
    coat = np.zeros_like(along) if huang else saturate(leaf["Coat"])
    scale = np.sqrt(np.pi / 8) * (0.265 * around + 1.194 * around**2 + 5.372 * around**22)
    total.add(
        Lobe.FIBRE,
        leaf.weight * white(),
        f0=_absorption(leaf),
        f90=_row(scale, leaf["Offset"], _variance(np.maximum(along * (1 - coat), _LEAST))),
        roughness=_variance(along),
        ior=max(float(leaf["IOR"].mean()), 1.0),
        distribution=FibreModel.CHIANG,
        stretch=ALONG,
        under=leaf.over,
    )


def _variance(roughness: np.ndarray) -> np.ndarray:
    """Of the longitudinal angle (Chiang et al. 2016, section 4.1)."""
    return (0.726 * roughness + 0.812 * roughness**2 + 3.7 * roughness**20) ** 2


def _row(*columns: np.ndarray) -> np.ndarray:
    return np.concatenate(np.broadcast_arrays(*columns), axis=-1).astype(np.float32)


def on_surfaces(term: Term) -> list[Term]:
    """What stands for a term on a mesh."""
    if term.kind != Lobe.FIBRE:
        return [term]
    shares = {Lobe.TRANSLUCENT if term.distribution == FibreModel.TRANSMISSION else Lobe.DIFFUSE: white()}
    if term.distribution == FibreModel.CHIANG:
        shares = dict(zip((Lobe.DIFFUSE, Lobe.TRANSLUCENT), _shares(term.f0, term.ior), strict=True))
    return [Term(kind, term.weight * share, by_angle=term.by_angle, under=term.under) for kind, share in shares.items()]


def on_fibres(term: Term) -> list[Term]:
    """What stands for a term on hair: translucent ones send light to the strand's other side; light walks in none."""
    if term.kind == Lobe.SUBSURFACE:
        return [Term(Lobe.DIFFUSE, term.weight, by_angle=term.by_angle, under=term.under)]
    if term.kind != Lobe.TRANSLUCENT:
        return [term]
    return [replace(term, kind=Lobe.FIBRE, distribution=FibreModel.TRANSLUCENT)]


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
