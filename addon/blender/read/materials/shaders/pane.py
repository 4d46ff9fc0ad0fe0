"""Principled glass with a thin wall: a clear or rough pane without thickness."""

from typing import TYPE_CHECKING

import numpy as np

from .....scene import Lobe
from ..node_math import mean_of_pane
from ..sums import ShaderSum, white

if TYPE_CHECKING:
    from ..closures import Leaf


def add_pane(leaf: "Leaf", total: ShaderSum, base: np.ndarray, left: np.ndarray) -> None:
    """Glass with a thin wall: mean reflection, and the rest straight through, or scattered as it is rough.

    `left` is the share that layers leave to it.
    """
    reflectance, way = mean_of_pane(leaf.ior)
    # A share, as what passes is the rest
    leaf.add_glossy(total, leaf.weight * np.float32(reflectance), white(), white())
    passing = leaf.weight * (1 - reflectance) * base**way
    total.transparent = total.transparent + passing * left * (1 - leaf.roughness)
    total.add(Lobe.TRANSLUCENT, passing * leaf.roughness, under=leaf.over)
