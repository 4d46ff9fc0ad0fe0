"""What lies over the base of a Principled shader, as Cycles has it: sheen over a coat over what the coat absorbs."""

from collections.abc import Hashable
from typing import TYPE_CHECKING

import numpy as np

from .....bsdf.broad.layers import mean_sheen_albedo, mean_tint
from .....scene import Lobe
from ..node_math import dielectric_f0, mean_fresnel, saturate
from ..sums import ShaderSum, white

if TYPE_CHECKING:
    from ..closures import Leaf

CUTOFF = 1e-5
"""Weights up to which Cycles leaves a closure out."""


def add_layers(leaf: "Leaf", total: ShaderSum) -> tuple[Hashable, np.ndarray]:
    """Add the layers of a Principled shader that scatter something.

    Returns
    -------
    name : hashable
        Of the lowest one; None without any.
    left : (h, w, 1 or 3) float32
        Share of the light that they leave to what they cover, averaged over directions by their cosine.
    """
    over, by_sheen = _add_sheen(leaf, total)
    over, by_coat = _add_coat(leaf, total, over)
    return over, by_sheen * by_coat


def _add_sheen(leaf: "Leaf", total: ShaderSum) -> tuple[Hashable, np.ndarray]:
    weight = np.maximum(leaf["Sheen Weight"], 0)
    color = weight * np.maximum(leaf["Sheen Tint"], 0) if (weight > CUTOFF).any() else np.zeros(1)
    if not color.any():
        return None, white()
    name, roughness = ("sheen", leaf.closure), saturate(leaf["Sheen Roughness"])
    total.add(Lobe.SHEEN, leaf.weight, f0=color, roughness=roughness, covers=name)
    brightest = color.max(axis=2, keepdims=True)
    return name, np.maximum(1 - brightest * mean_sheen_albedo(float(roughness.mean())), 0)


def _add_coat(leaf: "Leaf", total: ShaderSum, over: Hashable) -> tuple[Hashable, np.ndarray]:
    weight = np.maximum(leaf["Coat Weight"], 0)
    if not (weight > CUTOFF).any():
        return over, white()
    ior, left = max(float(leaf["Coat IOR"].mean()), 1.0), white()
    if ior > 1:
        f0, name = weight * dielectric_f0(np.array(ior, np.float32)) * white(), ("coat", leaf.closure)
        roughness = saturate(leaf["Coat Roughness"])
        total.add(
            Lobe.GLOSSY, leaf.weight, f0=f0, f90=weight * white(), ior=ior, roughness=roughness, covers=name, under=over
        )
        over, left = name, 1 - saturate(weight) * np.float32(mean_fresnel(ior))
    tint = np.maximum(leaf["Coat Tint"], 0)
    if (tint != 1).any():
        name, covered = ("coat tint", leaf.closure), saturate(weight)
        total.add(Lobe.ABSORBING, leaf.weight, f0=tint, roughness=covered, ior=ior, covers=name, under=over)
        over, left = name, left * (1 + covered * (mean_tint(tint, ior) - 1))
    return over, left
