"""What shader nodes say of their facets: how they are distributed, and the film on them."""

from collections.abc import Callable

import bpy
import numpy as np

from .....scene import Distribution
from ..node_math import saturate
from ..sums import black

DISTRIBUTIONS = {"BECKMANN": Distribution.BECKMANN, "ASHIKHMIN_SHIRLEY": Distribution.ASHIKHMIN_SHIRLEY}
"""Those that are not GGX, by Blender's names."""

_THINNEST = 0.1  # nm, up to which Cycles sees no film


def distribution_of(node: "bpy.types.Node") -> Distribution:
    """How the facets of a shader node are distributed."""
    return DISTRIBUTIONS.get(node.distribution, Distribution.GGX)


def film_of(node: "bpy.types.Node", value: Callable[[str], np.ndarray]) -> np.ndarray:
    """The thin film on a shader node's facets as `Closures` has it, (h, w, 3), by the values of its sockets.

    The thinnest films refract the less the thinner they are, since they reflect nothing by themselves.
    """
    if "Thin Film Thickness" not in node.inputs:
        return black()
    thickness = value("Thin Film Thickness")
    thickness = np.where(thickness > _THINNEST, thickness, 0)
    if not thickness.any():
        return black()
    late = bpy.app.version >= (5, 0, 0)
    t = saturate(thickness / (1 if late else 30))
    ior = 1 + (np.maximum(value("Thin Film IOR"), 1e-5) - 1) * (t * t * (3 - 2 * t))
    return np.concatenate(np.broadcast_arrays(thickness, ior, np.float32(late)), axis=-1).astype(np.float32)
