"""What a lamp emits from a place in a direction, by its pattern and its fall-off.

As Cycles' Light Falloff has it, light that spreads by 1/d² is multiplied by d for Linear and by d² for Constant, and
by d² / (s + d²) with Smooth s.
"""

import numpy as np

from ...core.compiling import kernel, kernel_array, part
from ...core.sampling.pixel_tables import pixel_in_square, pixel_towards
from ...core.vec3 import BLACK, ONE, ZERO, dot, minus, mul, row, times
from ...scene import PatternDomain
from .arrays import PatternArrays

_NORMALS, _PLACES = int(PatternDomain.NORMALS), int(PatternDomain.PLACES)
_HALF, _TINY = np.float32(0.5), np.float32(1e-30)


@part
def emission_towards(lamps, lamp, place, direction, distance):
    """The lamp's `emission` as it leaves a place on it in a direction and is seen at a distance."""
    light = row(lamps.emission, lamp)
    if lamps.patterns.differs[lamp]:
        light = times(mul(light, pattern_at(lamps, lamp, place, direction)), fall_off(lamps.patterns, lamp, distance))
    return light


@part
def pattern_at(lamps, lamp, place, direction):
    """What the lamp's pattern multiplies its emission by."""
    if lamps.patterns.table[lamp] < 0:
        return ONE, ONE, ONE
    pixel = pattern_pixel(lamps, lamp, place, direction)
    return BLACK if pixel < 0 else row(lamps.patterns.tables.values, pixel)


@part
def pattern_pixel(lamps, lamp, place, direction):
    """The pixel of the lamp's pattern that tells of a place and a direction; −1 where it has none."""
    patterns, offset = lamps.patterns, minus(place, row(lamps.position, lamp))
    table, domain = patterns.table[lamp], patterns.domain[lamp]
    if domain == _PLACES:
        x = dot(offset, row(lamps.axis_x, lamp)) / max(lamps.size[lamp, 0], _TINY) + _HALF
        y = dot(offset, row(lamps.axis_y, lamp)) / max(lamps.size[lamp, 1], _TINY) + _HALF
        return pixel_in_square(patterns.tables, table, x, y)
    if domain == _NORMALS:
        direction = times(offset, ONE / max(lamps.radius[lamp], _TINY))
    x, y = dot(row(lamps.axis_x, lamp), direction), dot(row(lamps.axis_y, lamp), direction)
    return pixel_towards(patterns.tables, table, (x, y, -dot(row(lamps.direction, lamp), direction)))


@part
def fall_off(patterns, lamp, distance):
    """What is left of a lamp's light at a distance, beside that it spreads."""
    share = ONE
    for _ in range(patterns.distance_power[lamp]):
        share *= distance
    smoothing = patterns.smoothing[lamp]
    if smoothing > ZERO:
        share *= distance * distance / (smoothing + distance * distance)
    return share


@kernel
def fall_off_of_many(patterns, lamp, distance, power):
    """Multiply what n rays carry, (n, 3), by `fall_off` of lamps (n,) at distances (n,); lamp −1: none."""
    for k in range(len(lamp)):
        if lamp[k] >= 0:
            share = fall_off(patterns, lamp[k], distance[k])
            for channel in range(3):
                power[k, channel] *= share


def fall_offs(patterns: PatternArrays, lamp: int, distances: np.ndarray) -> np.ndarray:
    """`fall_off` of one lamp at distances (n,), (n,) float32."""
    shares = np.ones((len(distances), 3), np.float32)
    fall_off_of_many(patterns, np.full(len(distances), lamp, np.int32), kernel_array(distances, np.float32), shares)
    return shares[:, 0]
