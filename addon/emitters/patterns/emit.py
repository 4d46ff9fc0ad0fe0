"""Photons of lamps with a pattern: drawn by it, in the direction or at the place that it is a function of.

With the pattern's density p, the radiant intensity I, the radiance L and the area A of the lamp:

- directions of a point or a spot: Φ/n = I(ω) / p(ω);
- directions of an area lamp, from places uniform by area: L(ω) A cos θ / p(ω), p being the pattern's times cos θ;
- places of an area lamp, by the unit square, and cosine-weighted directions: L(x) A' π / p(x), A' of the rectangle;
- normals of a sphere, and cosine-weighted directions: L(n) r² π / p(n) with L = I(n) / (π r²), which is I(n) / p(n).

A lamp far from the scene sends its light to the scene instead, evenly in directions, unless its normals are drawn.
"""

import numpy as np

from ...core.compiling import part
from ...core.sampling.pixel_tables import drawn_direction, drawn_in_square
from ...core.sampling.warps import PI, TWO_PI, at_versine, cosine_hemisphere
from ...core.vec3 import ONE, ZERO, along, dot, mul, plus, row, times, to_world
from ...scene import LightKind, LightPattern, Lights, PatternDomain
from ..aiming.discs import Discs, cone_to_whole
from ..aiming.projection_map import cone_to_ball, halved, redirected
from ..area import across, area_of, contains, is_area, place_on_area, spread_falloff
from ..point import leave_disc
from ..row import PATTERN, SourceRow
from ..spot import of_frame, spot_falloff
from .pattern import pattern_at, pattern_pixel

_SPOT = int(LightKind.SPOT)
_DIRECTIONS, _PLACES = int(PatternDomain.DIRECTIONS), int(PatternDomain.PLACES)
_HALF, _LEAST_COSINE, _TINY = np.float32(0.5), np.float32(1e-6), np.float32(1e-30)


def pattern_row(lights: Lights, lamp: int, pattern: LightPattern, discs: Discs) -> SourceRow:
    """How a lamp with a pattern emits photons; its power is measured."""
    reach = max(float(lights.radius[lamp]), float(np.linalg.norm(lights.size[lamp])) / 2)
    to_scene, axis = cone_to_whole(discs, lights.position[lamp], reach)
    own = 1.0 if pattern.domain == PatternDomain.PLACES else 1 - np.cos(pattern.angle)
    aims = to_scene < own / 2 and pattern.domain != PatternDomain.NORMALS
    cells = (64, 64, 1, 1, 1) if pattern.domain == PatternDomain.DIRECTIONS else (8, 8, 8, 8, 1)
    return SourceRow(PATTERN, lamp, cells, None, axis, to_scene, aims)


@part
def emit_pattern(emitters, source, u):
    """A photon drawn by its lamp's pattern: origin, direction and flux."""
    lamps, lamp = emitters.lamps, emitters.lamp[source]
    flat, domain = is_area(lamps, lamp), lamps.patterns.domain[lamp]
    centre, normal, share = row(lamps.position, lamp), row(lamps.direction, lamp), ONE
    place, reach = centre, lamps.radius[lamp]
    if domain != _DIRECTIONS:
        place, normal, share = _drawn_place(lamps, lamp, u[2], u[3])
        reach = ZERO
    elif flat:
        place, share = place_on_area(lamps, lamp, u[2], u[3]), area_of(lamps, lamp)
    direction, per_density = _drawn_direction(emitters, source, place, reach, normal, u[0], u[1])
    aimed, _ = halved(emitters.balls, source, u[4])
    direction, per_density = redirected(emitters.balls, source, aimed, u[0], u[1], place, reach, direction, per_density)
    if flat or domain != _DIRECTIONS:
        cosine = max(dot(direction, normal), ZERO)
        share *= cosine * spread_falloff(lamps, lamp, direction, cosine) if flat else cosine / PI
    else:
        place = leave_disc(lamps, lamp, direction, u[2], u[3])
    if lamps.kind[lamp] == _SPOT:
        share *= spot_falloff(lamps, lamp, direction)
    light = mul(row(lamps.emission, lamp), pattern_at(lamps, lamp, place, direction))
    return place, direction, times(light, share * per_density)


@part
def _drawn_place(lamps, lamp, u, v):
    """A place by a pattern over places or normals, the normal there, and 1 over the density; in m² of an area lamp."""
    patterns, centre, axis = lamps.patterns, row(lamps.position, lamp), row(lamps.direction, lamp)
    if patterns.domain[lamp] == _PLACES:
        x, y = drawn_in_square(patterns.tables, patterns.table[lamp], u, v)
        width, height = lamps.size[lamp, 0], lamps.size[lamp, 1]
        place, normal = plus(centre, across(lamps, lamp, (x - _HALF) * width, (y - _HALF) * height)), axis
        share = width * height if contains(lamps, lamp, place) else ZERO
    else:
        local, _ = drawn_direction(patterns.tables, patterns.table[lamp], u, v)
        normal = of_frame(lamps, lamp, (local[0], local[1], -local[2]))
        place, share = along(centre, lamps.radius[lamp], normal), ONE
    return place, normal, share / _density(lamps, lamp, place, normal)


@part
def _drawn_direction(emitters, source, place, reach, normal, u, v):
    """A direction, and 1 over its density, sr: to the scene, by the pattern, or cosine-weighted."""
    lamps, lamp = emitters.lamps, emitters.lamp[source]
    if emitters.aims[source]:
        versine, to_scene = cone_to_ball(emitters.discs.whole, emitters.discs.whole_radius, place, reach)
        return to_world(at_versine(u * versine, v), to_scene), np.float32(TWO_PI * versine)
    if lamps.patterns.domain[lamp] == _DIRECTIONS:
        local, _ = drawn_direction(lamps.patterns.tables, lamps.patterns.table[lamp], u, v)
        direction = of_frame(lamps, lamp, (local[0], local[1], -local[2]))
        return direction, ONE / _density(lamps, lamp, place, direction)
    local = cosine_hemisphere(u, v)
    return to_world(local, normal), PI / max(local[2], _LEAST_COSINE)


@part
def _density(lamps, lamp, place, direction):
    """With which the lamp's pattern draws a place or a direction."""
    pixel = pattern_pixel(lamps, lamp, place, direction)
    return max(lamps.patterns.tables.density[pixel], _TINY) if pixel >= 0 else _TINY
