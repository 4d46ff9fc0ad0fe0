"""Photons scattered outside of the target region, where light is wanted, half of which are directed towards it.

Of the photons that wide ground scatters, few fly through a window, and each of them stands for much ground: a room
would have bright spots where they end. So half of what is scattered outside goes towards the region. With a density
p(ω) = ½ cos θ/π + ½ [ω in the cone to the region]/Ω the light that a direction carries changes by (cos θ/π)/p(ω), which
is small towards the region, and never more than 2 (one-sample balance heuristic: Veach 1997, 9.2.4).
"""

from typing import NamedTuple

import numpy as np

from ..core.compiling import by_reference, part
from ..core.sampling.warps import PI, uniform_cone
from ..core.vec3 import ONE, ZERO, dot, minus, to_world
from ..emitters import Sphere
from ..emitters.aiming.projection_map import cone_to_ball
from ..emitters.aiming.target_region import FAR

SHARE = np.float32(0.5)
"""Of what is scattered outside, how much is sent towards the region."""

MOST_GAIN = np.float32(2)
"""Those that stay away carry up to twice as much each time, and would be bright spots if they came in after all."""

_FAR2 = np.float32(FAR**2)


@by_reference
class TargetRegion(NamedTuple):
    """The ball where light is wanted; of radius 0 nothing is directed to it."""

    centre: tuple
    radius: np.float32


def target_region(region: Sphere | None) -> TargetRegion:
    """A region as kernels take it; None is one to which nothing is directed."""
    centre, radius = ((0, 0, 0), 0) if region is None else (region.centre, region.radius)
    return TargetRegion(tuple(np.float32(x) for x in centre), np.float32(radius))


@part
def is_directed(region, gained, position):
    """Whether photons that are scattered broadly at a position are directed to the region.

    Those near it are not, and those that have stayed away for `MOST_GAIN`, the product of their factors so far.
    """
    away = minus(position, region.centre)
    far = dot(away, away) > _FAR2 * region.radius * region.radius
    return far and gained < MOST_GAIN and region.radius > ZERO


@part
def directed(region, position, up, onward, choice, u, v):
    """Where a photon goes that a broad lobe scattered `onward`, and what its weight is to be multiplied by.

    `up` is the geometric normal of the side that it leaves to; choice, u and v are random.
    """
    versine, axis = cone_to_ball(region.centre, region.radius, position, ZERO)
    within = choice < SHARE
    if within:
        onward = to_world(uniform_cone(u, v, 1.0 - versine), axis)
    else:
        within = dot(onward, axis) >= 1.0 - versine
    by_cosine = max(dot(onward, up), ZERO) / PI
    by_cone = 1.0 / (2.0 * np.pi * versine) if within else 0.0
    return onward, np.float32(by_cosine / max((ONE - SHARE) * by_cosine + SHARE * by_cone, 1e-30))
