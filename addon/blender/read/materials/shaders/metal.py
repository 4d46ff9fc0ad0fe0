"""Metal, of Metallic and of Principled shaders."""

from typing import TYPE_CHECKING

import bpy
import numpy as np

from .....scene import FresnelCurve, Lobe
from ..node_math import saturate
from ..sums import ShaderSum, black, white

if TYPE_CHECKING:
    from ..closures import Leaf


def add_metallic(leaf: "Leaf", total: ShaderSum) -> None:
    """A Metallic shader: by a colour and that of its edge, or by a complex index of refraction."""
    if leaf.closure.node.fresnel_type == "F82":
        add_metal(leaf, total, leaf.weight, leaf["Base Color"], leaf["Edge Tint"])
    else:
        n, k = np.maximum(leaf["IOR"], 0), np.maximum(leaf["Extinction"], 0)
        f0 = ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2)
        add_metal(leaf, total, leaf.weight, f0, n, FresnelCurve.CONDUCTOR)


def add_metal(
    leaf: "Leaf",
    total: ShaderSum,
    weight: np.ndarray,
    f0: np.ndarray,
    edge: np.ndarray,
    curve: FresnelCurve = FresnelCurve.F82,
) -> None:
    """Add a glossy closure with a metal's curve and the node's facets; see `Closures`.

    F82's curve is Schlick's where the edge has no tint. Blender 4.5 has no films on metal.
    """
    film = leaf.film if bpy.app.version >= (5, 0, 0) else black()
    if curve == FresnelCurve.F82:
        f0, edge = saturate(f0), saturate(edge)
        if (edge == 1).all() and not film.any():
            curve = FresnelCurve.DIELECTRIC
    total.add(Lobe.GLOSSY, weight, f0=f0, f90=white(), curve=curve, edge=edge, film=film, **leaf.reflecting_facets)
