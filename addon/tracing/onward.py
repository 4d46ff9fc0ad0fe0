"""What rays meet beyond a surface that they passed: each surface once, however flat they pass it.

A hit is known to a few units in the last place, across its surface; along a ray that is as much over the sine of the
angle between them. A ray that starts again just beyond a hit may thus meet the same surface again. It does so on the
same side of a surface that is parallel, and no farther from the plane passed than rounding reaches: that is how such
hits are told from others. Longer steps would miss walls that stand on the surface.
"""

import numpy as np

from ..core.compiling import part
from ..core.vec3 import ZERO, along, dot, row
from ..scene.hit import point_at, ray_offset
from .embree import intersect

_STEP = np.float32(1 / 8)
"""How far beyond a hit rays start again, over `ray_offset`, which leaves a wide margin; twice as far each time that
they meet the same surface."""

_PARALLEL = np.float32(1 - 1e-5)
_MAX_AGAIN = 16


@part
def onward(scene, tree, room, direction, far, passed, first):
    """The first triangle (−1: none) beyond a surface that a ray passed, its distance from the ray's origin, u and v.

    Parameters
    ----------
    far : float32, m
        Farthest distance looked at, from the ray's origin.
    passed : (triangle, distance, u, v)
    first : int32
        Triangle that was passed, too, in the same place: its side may be the other way round.
    """
    triangle, distance, u, v = passed
    start = point_at(scene, triangle, u, v)
    gap, left = ray_offset(scene, triangle, start), far - distance
    # Distances are counted from the surface passed until the end
    step, far_on, turn = _STEP * gap, _STEP * gap, 0
    while True:
        origin = along(start, far_on, direction)
        met, beyond, u, v = intersect(tree, room, origin, direction, max(left - far_on, ZERO))
        beyond += far_on
        again = met >= 0 and _is_passed(scene, direction, triangle, first, gap, met, beyond)
        if turn == _MAX_AGAIN or not again:
            return met, distance + beyond, u, v
        far_on = beyond + step
        step, turn = step + step, turn + 1


@part
def _is_passed(scene, direction, passed, first, gap, met, beyond):
    """Whether a triangle that a ray met is of the surface that it had passed and flies on from."""
    normal = row(scene.normals, passed)
    parallel = met == first or dot(row(scene.normals, met), normal) > _PARALLEL
    return parallel and beyond * abs(dot(normal, direction)) <= gap
