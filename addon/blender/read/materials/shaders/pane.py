"""Principled glass with a thin wall: a clear or rough pane without thickness."""

from typing import TYPE_CHECKING

import numpy as np

from .....scene import Lobe
from ..node_math import mean_of_pane, saturate
from ..sums import ShaderSum, white

if TYPE_CHECKING:
    from ..closures import Leaf


def add_pane(leaf: "Leaf", total: ShaderSum, base: np.ndarray, left: np.ndarray) -> None:
    """Glass with a thin wall: mean reflection, and the rest straight through, or around that as it is rough.

    `left` is the share that layers leave to it.
    """
    reflectance, way = mean_of_pane(leaf.ior)
    # A share, as what passes is the rest
    leaf.add_glossy(total, leaf.weight * np.float32(reflectance), white(), white())
    passing, roughness = leaf.weight * np.float32(1 - reflectance), _roughness_of_two_surfaces(leaf.roughness, leaf.ior)
    if not (roughness > 0).any():
        total.transparent = total.transparent + passing * base**way * left
        return
    tint, look = ("pane", leaf.closure), {"f0": base, "roughness": white()[..., :1], "ior": leaf.ior}
    total.add(Lobe.ABSORBING, leaf.weight, covers=tint, under=leaf.over, **look, **leaf.normal())
    total.add(Lobe.PANE, passing, f0=white(), f90=white(), roughness=roughness, under=tint, **leaf.normal())


def _roughness_of_two_surfaces(roughness: np.ndarray, ior: float) -> np.ndarray:
    """Of what two refractions do: α is times √(3.4 (η − 1)(η − ½)²/η³) (Kulla and Conty 2017)."""
    share = 3.4 * max(ior - 1, 0) * (ior - 0.5) ** 2 / ior**3
    return np.sqrt(saturate(roughness**2 * np.float32(share**0.5))).astype(np.float32)
