"""Area lamps: a rectangle or an ellipse of radiance L on its front, power πLA whatever its spread.

With a spread the radiance at an angle θ from the axis is a share max(tan h − tan θ, 0) / (tan h − h) of L, h being half
of the spread: what a grid of slats lets through, scaled to keep the power, ∫ cos θ dω = π.
"""

import numpy as np

from ..core.compiling import part, routine
from ..core.sampling.warps import PI, TWO_PI, at_versine, cosine_hemisphere, uniform_disk
from ..core.vec3 import ONE, ZERO, along, direction_to, dot, minus, plus, row, times, to_world
from ..scene import LightKind, Lights
from .aiming.discs import Discs, cone_to_whole
from .aiming.projection_map import cone_to_ball, halved, redirected
from .row import SourceRow

_RECTANGLE, _ELLIPSE = int(LightKind.RECTANGLE), int(LightKind.ELLIPSE)
_HALF, _QUARTER, _QUARTER_PI = np.float32(0.5), np.float32(0.25), np.float32(np.pi / 4)
_LEAST_COSINE, _TINY, _INFINITY = np.float32(1e-6), np.float32(1e-12), np.float32(np.inf)
_NO_SPREAD = np.float32(np.pi - 2e-3)
"""A spread of which no more than a thousandth is cut off, rad."""


def spread_columns(spread: np.ndarray) -> dict[str, np.ndarray]:
    """What parts need of spreads (l,): tan h (infinite without a spread), tan h − h, and sin² h, (l,) float32 each."""
    # Parallel light is nearly so; and tan h − h = h³/3 + … loses its digits for narrow spreads
    h = np.clip(spread.astype(np.float64) / 2, 1e-3, np.pi / 2 - 1e-4)
    gap, spreads = np.where(h < 0.005, h**3 / 3, np.tan(h) - h), spread < _NO_SPREAD
    columns = {"tan_spread": (np.tan(h), np.inf), "spread_gap": (gap, 1), "sin2_spread": (np.sin(h) ** 2, 1)}
    return {name: np.where(spreads, own, none).astype(np.float32) for name, (own, none) in columns.items()}


def areas_of(lights: Lights) -> np.ndarray:
    """Areas of the lamps, (l,) float32, m²; 0 of those that are no area lamps."""
    box = lights.size.prod(axis=1)
    return np.where(lights.kind == LightKind.ELLIPSE, np.float32(np.pi / 4) * box, box)


def area_row(lights: Lights, lamp: int, discs: Discs) -> SourceRow:
    """How an area lamp emits photons: from far away only to the scene."""
    reach = float(np.linalg.norm(lights.size[lamp])) / 2
    versine, axis = cone_to_whole(discs, lights.position[lamp], reach)
    aims = bool(2 * versine < spread_columns(lights.spread)["sin2_spread"][lamp])
    power = lights.emission[lamp].astype(np.float64) * np.pi * float(areas_of(lights)[lamp])
    return SourceRow(int(lights.kind[lamp]), lamp, (8, 8, 8, 8, 1), None if aims else power, axis, versine, aims)


@routine
def emit_area(emitters, source, u):
    """A place uniform by area, a cosine-weighted direction within the spread, or one of the cone around the scene."""
    lamps, lamp = emitters.lamps, emitters.lamp[source]
    origin, axis = place_on_area(lamps, lamp, u[2], u[3]), row(lamps.direction, lamp)
    if emitters.aims[source]:
        versine, to_scene = cone_to_ball(emitters.discs.whole, emitters.discs.whole_radius, origin, ZERO)
        direction, per_density = (
            to_world(at_versine(u[0] * versine, u[1]), to_scene),
            np.float32(TWO_PI * versine),
        )
    else:
        sin2 = lamps.sin2_spread[lamp]
        local = cosine_hemisphere(u[0] * sin2, u[1])
        direction, per_density = to_world(local, axis), sin2 * PI / max(local[2], _LEAST_COSINE)
    aimed, _ = halved(emitters.balls, source, u[4])
    direction, per_density = redirected(emitters.balls, source, aimed, u[0], u[1], origin, ZERO, direction, per_density)
    cosine = max(dot(direction, axis), ZERO)
    share = area_of(lamps, lamp) * cosine * per_density * spread_falloff(lamps, lamp, direction, cosine)
    return origin, direction, times(row(lamps.emission, lamp), share)


@part
def sample_area(lamps, lamp, position, u, v):
    """As `sample_point`: points uniform by area, E = L A cos θ cos θ' / d²."""
    centre, axis, area = row(lamps.position, lamp), row(lamps.direction, lamp), area_of(lamps, lamp)
    height = dot(minus(position, centre), axis)
    if height <= ZERO:
        return position, axis, ZERO
    radius = lamps.tan_spread[lamp] * height if lamps.tan_spread[lamp] < _INFINITY else _INFINITY
    if PI * radius * radius < area:
        # Little of the lamp shines at this position: points of that part
        x, y = uniform_disk(u, v)
        foot = minus(position, times(axis, height))
        target = plus(foot, across(lamps, lamp, x * radius, y * radius))
        area = PI * radius * radius if contains(lamps, lamp, target) else ZERO
    else:
        target = place_on_area(lamps, lamp, u, v)
    way, distance = direction_to(position, target)
    cosine = max(-dot(way, axis), ZERO)
    return target, way, area * cosine / (distance * distance) * spread_falloff(lamps, lamp, times(way, -ONE), cosine)


@part
def meet_area(lamps, lamp, origin, direction):
    """As `meet_point`: from the front only and within the spread."""
    axis = row(lamps.direction, lamp)
    cosine, height = -dot(direction, axis), dot(minus(origin, row(lamps.position, lamp)), axis)
    met, cosine = cosine > _LEAST_COSINE and height > ZERO, max(cosine, _LEAST_COSINE)
    distance = max(height, ZERO) / cosine
    met = met and contains(lamps, lamp, along(origin, distance, direction))
    share = spread_falloff(lamps, lamp, times(direction, -ONE), cosine)
    return met, distance, share, distance * distance / max(area_of(lamps, lamp) * cosine, _TINY)


@part
def is_area(lamps, lamp):
    """Whether a lamp is one of these."""
    return lamps.kind[lamp] in (_RECTANGLE, _ELLIPSE)


@part
def area_of(lamps, lamp):
    """Area of an area lamp, m²."""
    box = lamps.size[lamp, 0] * lamps.size[lamp, 1]
    return _QUARTER_PI * box if lamps.kind[lamp] == _ELLIPSE else box


@part
def place_on_area(lamps, lamp, u, v):
    """A point uniform by area."""
    x, y = u - _HALF, v - _HALF
    if lamps.kind[lamp] == _ELLIPSE:
        a, b = uniform_disk(u, v)
        x, y = _HALF * a, _HALF * b
    return plus(row(lamps.position, lamp), across(lamps, lamp, x * lamps.size[lamp, 0], y * lamps.size[lamp, 1]))


@part
def across(lamps, lamp, x, y):
    """A way across the lamp's plane."""
    return plus(times(row(lamps.axis_x, lamp), x), times(row(lamps.axis_y, lamp), y))


@part
def contains(lamps, lamp, position):
    """Whether a point of the lamp's plane lies on the lamp."""
    offset = minus(position, row(lamps.position, lamp))
    x = abs(dot(offset, row(lamps.axis_x, lamp))) / lamps.size[lamp, 0]
    y = abs(dot(offset, row(lamps.axis_y, lamp))) / lamps.size[lamp, 1]
    return x * x + y * y <= _QUARTER if lamps.kind[lamp] == _ELLIPSE else max(x, y) <= _HALF


@part
def spread_falloff(lamps, lamp, direction, cosine):
    """Share of the radiance that goes in a direction, at a cosine from the axis."""
    if lamps.tan_spread[lamp] == _INFINITY:
        return ONE
    aside = minus(direction, times(row(lamps.direction, lamp), cosine))
    tangent = np.sqrt(dot(aside, aside)) / max(cosine, _LEAST_COSINE)
    return max(lamps.tan_spread[lamp] - tangent, ZERO) / lamps.spread_gap[lamp]
