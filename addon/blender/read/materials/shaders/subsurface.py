"""Subsurface scattering, of Principled and of its own shader, as the Blender that bakes has it.

What diffuse rays see of it is a walk through the body from Blender 5.0 on. Before, they see diffuse reflection, and
cameras alone the walk (`View.walks`), as bakes of the body itself do. By Christensen's and Burley's method all see
diffuse reflection.
"""

from collections.abc import Hashable
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from .....scene import Lobe
from ..node_math import saturate
from ..sums import ShaderSum

if TYPE_CHECKING:
    from ..closures import Leaf

_LEAST_PATH = 1e-8  # m, from which on a channel of Cycles' walks
_LEAST_IOR, _MOST_IOR = 1.01, 3.8
_PER_4_PI = np.float32(0.25 / np.pi)


def add_subsurface_shader(leaf: "Leaf", total: ShaderSum) -> None:
    """A Subsurface Scattering shader."""
    under, color = leaf.layer and leaf.layer.place, np.maximum(leaf["Color"], 0)
    if not (leaf.walks and is_body(leaf.closure.node)):
        total.add(Lobe.DIFFUSE, leaf.weighted, under=under, **leaf.normal())
        return
    path = np.maximum(leaf["Radius"] * leaf["Scale"], 0)
    add_body(leaf, total, leaf.weight, color, path, np.sqrt(leaf.roughness), leaf.ior, under)


def add_principled_body(
    leaf: "Leaf", total: ShaderSum, weight: np.ndarray, base: np.ndarray, ior: float, under: Hashable
) -> np.ndarray:
    """What of a Principled shader's base is a body, with the index of refraction of its layer; the weight left."""
    share = saturate(leaf["Subsurface Weight"])
    if not share.any() or not (leaf.walks and is_body(leaf.closure.node)):
        return weight
    if _method(leaf.closure.node) == "RANDOM_WALK_SKIN":
        ior = float(leaf["Subsurface IOR"].mean())
    path = np.maximum(leaf["Subsurface Radius"] * leaf["Subsurface Scale"], 0)
    add_body(leaf, total, weight * share, base, path, leaf.roughness, ior, under)
    return weight * (1 - share)


def add_body(
    leaf: "Leaf",
    total: ShaderSum,
    weight: np.ndarray,
    color: np.ndarray,
    path: np.ndarray,
    roughness: np.ndarray,
    ior: float,
    under: Hashable,
) -> None:
    """A closure by which light walks, and a diffuse one for the channels in which it does not get anywhere.

    Parameters
    ----------
    path : (h, w, 3) float32, m
        Radius by scale.
    roughness : (h, w, 1) float32
        Of the facets through which views enter.
    """
    walks = path >= _LEAST_PATH
    if not walks.all():
        total.add(Lobe.DIFFUSE, weight * color * ~walks, under=under, **leaf.normal())
    if not walks.any():
        return
    node, ior = leaf.closure.node, float(np.clip(ior, _LEAST_IOR, _MOST_IOR))
    method = _method(node)
    skin, plain = method == "RANDOM_WALK_SKIN", method == "RANDOM_WALK" and bpy.app.version >= (5, 2, 0)
    anisotropy = leaf["Anisotropy" if node.type == "SUBSURFACE_SCATTERING" else "Subsurface Anisotropy"].mean()
    g = float(np.clip(anisotropy, -0.99 if bpy.app.version >= (5, 2, 0) else 0, 0.99 if plain else 0.9))
    if skin:
        path, roughness = path * _skin_scale(color, ior), np.ones((1, 1, 1), np.float32)
    elif not plain:
        path = path * _PER_4_PI
    look = np.array([[[g, 0.5 * skin, not plain and g >= 0]]], np.float32)
    facets: dict[str, Any] = {"roughness": roughness, "ior": ior, "edge": look, "under": under, **leaf.normal()}
    total.add(Lobe.SUBSURFACE, weight * color * walks, f0=color, f90=path.astype(np.float32), **facets)


def is_body(node: "bpy.types.Node") -> bool:
    """Whether light may walk through what a shader node is on."""
    weight = next((one for one in node.inputs if one.identifier == "Subsurface Weight"), None)
    there = weight is None or weight.is_linked or weight.default_value > 0
    return there and _method(node) not in (None, "BURLEY")


def _method(node: "bpy.types.Node") -> str | None:
    """The method of subsurface scattering of a shader node; None of those that have none."""
    return getattr(node, "falloff" if node.type == "SUBSURFACE_SCATTERING" else "subsurface_method", None)


def _skin_scale(color: np.ndarray, ior: float) -> np.ndarray:
    """Mean free path of skin over its radius: √(3 (1 − α')), with the albedo α' of a dipole of the colour.

    Jensen et al., "A Practical Model for Subsurface Light Transport", 2001: A is α'/2 (1 + e^(−4/3 a s)) e^(−s), with
    s = √(3 (1 − α')) and a by the diffuse Fresnel reflectance; α' is found by halving, in as many steps as Cycles.
    """
    fresnel = (-1.440 / ior + 0.710) / ior + 0.668 + 0.0636 * ior
    internal = 4 / 3 * (1 + fresnel) / (1 - fresnel)
    low, high = np.zeros_like(color), np.ones_like(color)
    for _ in range(12):
        middle = (low + high) / 2
        s = np.sqrt(3 * (1 - middle))
        below = middle / 2 * (1 + np.exp(-internal * s)) * np.exp(-s) < color
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    albedo = np.where(color < 1e-4, 0, np.where(color >= 0.995, 0.999999, middle))
    return np.sqrt(3 * (1 - albedo)).astype(np.float32)
