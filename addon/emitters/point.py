"""Point lamps: an intensity I(ω) that leaves, in each direction, a disc of radius r that faces it, or a sphere.

The disc is exact for lamps that are spheres, and how Cycles' lamps with soft falloff look from afar. `lamps` is
`LampArrays`, and the lamp's `emission` is I.
"""

import numpy as np

from ..core.compiling import part, routine
from ..core.sampling.warps import PI, TWO_PI, at_versine, uniform_disk
from ..core.vec3 import ONE, TWO, ZERO, along, direction_to, dot, minus, row, times, to_world
from ..scene import Lights
from .aiming.discs import Discs, cone_to_whole
from .aiming.projection_map import halved, redirected
from .row import SourceRow

_LEAST_COSINE, _TINY = np.float32(1e-6), np.float32(1e-12)


def point_row(lights: Lights, lamp: int, discs: Discs, versine: float = 2.0) -> SourceRow:
    """How a lamp emits photons: into the cone around the scene, if that is narrower than its own, of this versine."""
    to_scene, axis = cone_to_whole(discs, lights.position[lamp], float(lights.radius[lamp]))
    power = lights.emission[lamp].astype(np.float64) * 2 * np.pi * min(to_scene, versine)
    kind, cells = int(lights.kind[lamp]), (64, 64, 1, 1, 1)
    return SourceRow(kind, lamp, cells, power, axis, min(to_scene, versine), aims=to_scene < versine)


@routine
def emit_point(emitters, source, u):
    """A direction evenly from the cone, then a place on the disc that faces it: origin, direction and flux."""
    lamps, lamp = emitters.lamps, emitters.lamp[source]
    direction = to_world(at_versine(u[0] * emitters.versine[source], u[1]), row(emitters.axis, source))
    per_density = np.float32(TWO_PI * emitters.versine[source])
    aimed, _ = halved(emitters.balls, source, u[4])
    at, reach = row(lamps.position, lamp), lamps.radius[lamp]
    direction, per_density = redirected(emitters.balls, source, aimed, u[0], u[1], at, reach, direction, per_density)
    return leave_disc(lamps, lamp, direction, u[2], u[3]), direction, times(row(lamps.emission, lamp), per_density)


@part
def leave_disc(lamps, lamp, direction, u, v):
    """Where light leaves a lamp in a direction: a place on its disc, or on the half of the sphere that is seen."""
    x, y = uniform_disk(u, v)
    z = np.sqrt(max(ONE - u, ZERO)) if lamps.sphere[lamp] else ZERO
    return along(row(lamps.position, lamp), lamps.radius[lamp], to_world((x, y, z), direction))


@part
def sample_point(lamps, lamp, position, u, v):
    """A point of the lamp as a position sees it, the direction to it, and g: see `lamps`."""
    target, way, share, _ = sample_ball(lamps, lamp, position, u, v)
    return target, way, share


@part
def sample_ball(lamps, lamp, position, u, v):
    """As `sample_point`, and whether the position is outside of the lamp.

    Points of the disc of radius r that faces the position have the radiance L = I/(πr²). E = L A cos θ cos θ' / d² =
    I cos θ cos θ' / d², which on the axis adds up to I/(d² + r²), as in Cycles. Of a sphere a position sees the cap
    within the half angle arcsin(r/d) instead, whose points are uniform by the solid angle Ω: E = L cos θ Ω. From inside
    all directions are seen.
    """
    centre, radius = row(lamps.position, lamp), lamps.radius[lamp]
    if not (lamps.sphere[lamp] and radius > ZERO):
        axis, _ = direction_to(centre, position)
        x, y = uniform_disk(u, v)
        target = along(centre, radius, to_world((x, y, ZERO), axis))
        way, distance = direction_to(position, target)
        return target, way, -dot(way, axis) / (distance * distance), True
    axis, away = direction_to(position, centre)
    outside, sine2 = away > radius, radius * radius / (away * away)
    versine = sine2 / (ONE + np.sqrt(ONE - sine2)) if outside else TWO
    local = at_versine(u * versine, v)
    chord = np.sqrt(max(radius * radius - away * away * (local[0] * local[0] + local[1] * local[1]), ZERO))
    way = to_world(local, axis)
    target = along(position, away * local[2] - (chord if outside else -chord), way)
    return target, way, TWO * versine / (radius * radius), outside


@part
def meet_point(lamps, lamp, origin, direction):
    """Whether a ray meets the lamp, the distance, the radiance over the emission, and the density: see `lamps`."""
    met, distance, share, density, _ = meet_ball(lamps, lamp, origin, direction)
    return met, distance, share, density


@part
def meet_ball(lamps, lamp, origin, direction):
    """As `meet_point`, and whether the origin is inside: the sphere's far side is met then."""
    centre, r = minus(row(lamps.position, lamp), origin), lamps.radius[lamp]
    before, away = dot(centre, direction), np.sqrt(dot(centre, centre))
    off_axis = minus(centre, times(direction, before))
    aside, inside = dot(off_axis, off_axis), lamps.sphere[lamp] and away < r
    cosine = max(before / max(away, _TINY), _LEAST_COSINE)
    area = PI * max(r * r, _TINY)
    if lamps.sphere[lamp]:
        half_chord = np.sqrt(max(r * r - aside, ZERO))
        distance = before + half_chord if inside else before - half_chord
        sine = min(r / max(away, _TINY), ONE)
        versine = TWO if inside else sine * sine / (ONE + np.sqrt(ONE - sine * sine))
        density = ONE / max(TWO_PI * versine, _TINY)
    else:
        distance = away / cosine
        off_disc = minus(centre, times(direction, distance))
        aside = dot(off_disc, off_disc)
        density = distance * distance / (area * cosine)
    return aside < r * r and (before > ZERO or inside), distance, ONE / area, density, inside
