"""What lies over the base of a Principled shader, as Cycles has it: sheen over a coat over what the coat absorbs."""

from collections.abc import Hashable
from typing import TYPE_CHECKING

import bpy
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


def coat_normal(leaf: "Leaf") -> dict[str, object]:
    """The normal of a coat as `Term` has it; from Blender 5.0 on a coat without one has that of the base."""
    linked = any(one.identifier == "Coat Normal" and one.is_linked for one in leaf.closure.node.inputs)
    return leaf.normal("Coat Normal") if linked or bpy.app.version < (5, 0, 0) else leaf.normal()


def _add_sheen(leaf: "Leaf", total: ShaderSum) -> tuple[Hashable, np.ndarray]:
    weight = np.maximum(leaf["Sheen Weight"], 0)
    color = weight * np.maximum(leaf["Sheen Tint"], 0) if (weight > CUTOFF).any() else np.zeros(1)
    if not color.any():
        return None, white()
    name, roughness = ("sheen", leaf.closure), saturate(leaf["Sheen Roughness"])
    # Cycles mixes the normals by the coat's weight
    normal = coat_normal(leaf) if leaf["Coat Weight"].mean() > 0.5 else leaf.normal()
    total.add(Lobe.SHEEN, leaf.weight, f0=color, roughness=roughness, covers=name, **normal)
    brightest = color.max(axis=2, keepdims=True)
    return name, np.maximum(1 - brightest * mean_sheen_albedo(float(roughness.mean())), 0)


def _add_coat(leaf: "Leaf", total: ShaderSum, over: Hashable) -> tuple[Hashable, np.ndarray]:
    weight = np.maximum(leaf["Coat Weight"], 0)
    if not (weight > CUTOFF).any():
        return over, white()
    ior, left = max(float(leaf["Coat IOR"].mean()), 1.0), white()
    if ior > 1:
        f0, name = weight * dielectric_f0(np.array(ior, np.float32)) * white(), ("coat", leaf.closure)
        facets = {"ior": ior, "roughness": saturate(leaf["Coat Roughness"])}
        colors = {"f0": f0, "f90": weight * white()}
        total.add(Lobe.GLOSSY, leaf.weight, covers=name, under=over, **colors, **facets, **coat_normal(leaf))
        over, left = name, 1 - saturate(weight) * np.float32(mean_fresnel(ior))
    tint = np.maximum(leaf["Coat Tint"], 0)
    if (tint != 1).any():
        name, covered = ("coat tint", leaf.closure), saturate(weight)
        look = {"f0": tint, "roughness": covered, "ior": ior}
        total.add(Lobe.ABSORBING, leaf.weight, covers=name, under=over, **look, **coat_normal(leaf))
        over, left = name, left * (1 + covered * (mean_tint(tint, ior) - 1))
    return over, left
