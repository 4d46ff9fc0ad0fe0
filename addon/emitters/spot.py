"""Spot lamps: point lamps whose intensity falls off to the edge of a cone, which may be stretched.

With c the cosine of the cone's half angle, b the blend and θ the angle from the axis, the share of the intensity is
s((cos θ − c) / (b(1 − c))), s(t) = t²(3 − 2t), as in Cycles. In a cone that is stretched by (a, b) a direction
(x, y, z) of the lamp's frame counts as (x/a, y/b, z).
"""

import numpy as np

from ..core.compiling import kernel, part, routine
from ..core.sampling.warps import TWO_PI, at_versine
from ..core.vec3 import ONE, TWO, ZERO, dot, length, negative, plus, put, row, times, to_world
from ..scene import Lights
from .aiming.discs import Discs
from .aiming.projection_map import halved, redirected
from .point import leave_disc, meet_ball, point_row, sample_ball
from .row import SourceRow

_TINIEST, _LEAST_BLEND, _THREE = np.float32(1e-30), np.float32(1e-5), np.float32(3)


def spot_row(lights: Lights, lamp: int, discs: Discs) -> SourceRow:
    """How a spot emits photons: into its cone, or into that around the scene if it is narrower."""
    return point_row(lights, lamp, discs, 1 - np.cos(float(lights.angle[lamp]) / 2))._replace(power=None)


@routine
def emit_spot(emitters, source, u):
    """A direction evenly from the cone, weighed by the falloff, and a place on the disc that faces it.

    The directions of a stretched cone are (ax, by, z) / |(ax, by, z)| of a round one's, whose solid angles grow by
    ab / |(ax, by, z)|³.
    """
    lamps, lamp = emitters.lamps, emitters.lamp[source]
    local = at_versine(u[0] * emitters.versine[source], u[1])
    per_density = np.float32(TWO_PI * emitters.versine[source])
    if emitters.aims[source]:
        direction = to_world(local, row(emitters.axis, source))
    else:
        a, b = lamps.stretch[lamp, 0], lamps.stretch[lamp, 1]
        local = local[0] * a, local[1] * b, local[2]
        size = length(local)
        direction = times(of_frame(lamps, lamp, local), ONE / size)
        per_density *= a * b / (size * size * size)
    aimed, _ = halved(emitters.balls, source, u[4])
    at, reach = row(lamps.position, lamp), lamps.radius[lamp]
    direction, per_density = redirected(emitters.balls, source, aimed, u[0], u[1], at, reach, direction, per_density)
    share = per_density * spot_falloff(lamps, lamp, direction)
    return leave_disc(lamps, lamp, direction, u[2], u[3]), direction, times(row(lamps.emission, lamp), share)


@part
def spot_falloff(lamps, lamp, direction):
    """Share of a spot's intensity that goes in a direction."""
    x = dot(row(lamps.axis_x, lamp), direction) / lamps.stretch[lamp, 0]
    y = dot(row(lamps.axis_y, lamp), direction) / lamps.stretch[lamp, 1]
    z = dot(row(lamps.direction, lamp), direction)
    cosine, versine = z / np.sqrt(max(x * x + y * y + z * z, _TINIEST)), lamps.versine[lamp]
    t = min(max((cosine - (ONE - versine)) / max(lamps.blend[lamp] * versine, _LEAST_BLEND), ZERO), ONE)
    return t * t * (_THREE - TWO * t)


@part
def sample_spot(lamps, lamp, position, u, v):
    """As `sample_point`; inside of a sphere there is no cone, as in Cycles."""
    target, way, share, outside = sample_ball(lamps, lamp, position, u, v)
    return target, way, share * spot_falloff(lamps, lamp, negative(way)) if outside else share


@part
def meet_spot(lamps, lamp, origin, direction):
    """As `meet_point`."""
    met, distance, share, density, inside = meet_ball(lamps, lamp, origin, direction)
    return met, distance, share if inside else share * spot_falloff(lamps, lamp, negative(direction)), density


@part
def of_frame(lamps, lamp, local):
    """A direction of the lamp's frame in world space."""
    across = plus(times(row(lamps.axis_x, lamp), local[0]), times(row(lamps.axis_y, lamp), local[1]))
    return plus(across, times(row(lamps.direction, lamp), local[2]))


@kernel
def leave_in_directions(lamps, lamp, spot, directions, per_density, u, origins, flux):
    """Rays that leave a point or spot lamp in directions (n, 3) drawn otherwise, with 1 over their densities (n,), sr.

    `u` (n, 2) are points of the unit square for places; writes origins and flux, (n, 3).
    """
    for k in range(len(directions)):
        direction = row(directions, k)
        share = per_density[k] * spot_falloff(lamps, lamp, direction) if spot else per_density[k]
        put(origins, k, leave_disc(lamps, lamp, direction, u[k, 0], u[k, 1]))
        put(flux, k, times(row(lamps.emission, lamp), share))
