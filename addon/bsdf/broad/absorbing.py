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
    ratio = ONE / max(closure.ior, ONE)
    way = ONE / np.sqrt(max(ONE - ratio * ratio * (ONE - cos * cos), np.float32(1e-6)))
    share, tint = closure.roughness, closure.f0
    return (
        ONE + share * (max(tint[0], ZERO) ** way - ONE),
        ONE + share * (max(tint[1], ZERO) ** way - ONE),
        ONE + share * (max(tint[2], ZERO) ** way - ONE),
    )
