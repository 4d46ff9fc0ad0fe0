"""Shaders that scatter broadly: rough diffuse, sheen and toon."""

from collections.abc import Hashable
from typing import TYPE_CHECKING

import numpy as np

from .....scene import Lobe
from ..node_math import saturate
from ..sums import ShaderSum

if TYPE_CHECKING:
    from ..closures import Leaf

LEAST_ROUGHNESS = 1e-5
"""From which on Cycles takes Oren and Nayar's reflection for Lambert's."""


def add_diffuse(leaf: "Leaf", total: ShaderSum) -> None:
    """A Diffuse BSDF; in a mix by Fresnel's curve with a glossy one that lies over it."""
    under = leaf.layer and leaf.layer.place
    add_base(leaf, total, leaf.weighted, leaf.color, "Roughness", under)


def add_base(
    leaf: "Leaf", total: ShaderSum, weight: np.ndarray, color: np.ndarray, roughness: str, under: Hashable
) -> None:
    """Diffuse reflection with a weight that has the colour in it, and a roughness by the name of its socket."""
    rough = saturate(leaf[roughness])
    if (rough < LEAST_ROUGHNESS).all():
        total.add(Lobe.DIFFUSE, weight, under=under, **leaf.normal())
    else:
        total.add(Lobe.ROUGH_DIFFUSE, weight, f0=color, roughness=rough, under=under, **leaf.normal())


def add_sheet(leaf: "Leaf", total: ShaderSum, weight: np.ndarray, base: np.ndarray, under: Hashable) -> np.ndarray:
    """Subsurface scattering with a thin wall, to both sides of a sheet by its anisotropy; the weight that is left."""
    share, forward = saturate(leaf["Subsurface Weight"]), leaf["Subsurface Anisotropy"]
    scattered = weight * share * base
    add_base(leaf, total, scattered * saturate((1 - forward) / 2), base, "Diffuse Roughness", under)
    total.add(Lobe.TRANSLUCENT, scattered * saturate((1 + forward) / 2), under=under, **leaf.normal())
    return weight * (1 - share)


def add_sheen(leaf: "Leaf", total: ShaderSum) -> None:
    """A Sheen BSDF."""
    roughness = saturate(leaf["Roughness"])
    if leaf.closure.node.distribution == "ASHIKHMIN":
        total.add(Lobe.VELVET, leaf.weighted, roughness=roughness, **leaf.normal())
    else:
        total.add(Lobe.SHEEN, leaf.weight, f0=leaf.color, roughness=roughness, **leaf.normal())


def add_toon(leaf: "Leaf", total: ShaderSum) -> None:
    """A Toon BSDF."""
    kind = Lobe.GLOSSY_TOON if leaf.closure.node.component == "GLOSSY" else Lobe.TOON
    angles = {"roughness": saturate(leaf["Size"]), "f90": saturate(leaf["Smooth"])}
    total.add(kind, leaf.weighted, **angles, **leaf.normal())
