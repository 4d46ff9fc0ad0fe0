"""A layer that reflects nothing and tints what it covers: what a coat absorbs.

`f0` is its transmittance along the normal, by its thickness; along a refracted way it is that to the power of 1/cos θt
(Beer's law). `roughness` is the share of the surface that it covers, `ior` that of the layer.
"""

import numpy as np

from ...core.compiling import part
from ...core.vec3 import ONE, ZERO


@part
def transmittance(closure, cos):
    """Share of the light that it leaves to what it covers, seen at `cos`."""
    left, share = along_way(closure.f0, closure.ior, cos), closure.roughness
    return ONE + share * (left[0] - ONE), ONE + share * (left[1] - ONE), ONE + share * (left[2] - ONE)


@part
def along_way(tint, ior, cos):
    """Transmittance of a layer along the refracted way of what is seen at `cos`."""
    ratio = ONE / max(ior, ONE)
    way = ONE / np.sqrt(max(ONE - ratio * ratio * (ONE - cos * cos), np.float32(1e-6)))
    return max(tint[0], ZERO) ** way, max(tint[1], ZERO) ** way, max(tint[2], ZERO) ** way
