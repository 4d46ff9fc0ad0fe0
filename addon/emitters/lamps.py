"""Lamps as kernels take them: points of any lamp as a position samples them, and what any lamp shows along a ray.

Each kind's formulas are in its own file, two parts of it for the functions here:

- `sample_NAME`, of a position and two numbers u, v in [0, 1): a point on the lamp, the unit direction to it, and g,
  such that the mean of emission · g · (cosine at the position)⁺ is the irradiance without shadows. With a radiance as
  emission, and points of density p by area, g is cos θ'/(d² p), θ' being the angle at the lamp.
- `meet_NAME`, of a ray: whether it meets the lamp, the distance, the radiance over the emission, and the density by
  solid angle with which `sample_NAME` finds that direction from the ray's origin.

Lamps that have a size are seen in mirrors and through glass, and block no light, as Cycles 4.5 and 5.2 show them: discs
that face who looks, spheres, the front of area lamps, suns behind everything.
"""

from typing import NamedTuple

import numpy as np

from ..core.compiling import by_reference, kernel_array, part, routine
from ..core.vec3 import BLACK, ONE, ZERO, along, dot, length, minus, negative, plus, row, times
from ..scene import LightKind, Lights, RayKind
from .area import meet_area, sample_area, spread_columns
from .patterns.arrays import PatternArrays, pattern_arrays
from .patterns.pattern import emission_towards
from .point import meet_point, sample_point
from .spot import meet_spot, sample_spot
from .sun import meet_sun, sample_sun

_POINT, _SPOT, _SUN = int(LightKind.POINT), int(LightKind.SPOT), int(LightKind.SUN)
_INFINITY = np.float32(np.inf)


@by_reference
class LampArrays(NamedTuple):
    """The l lamps of a scene: the columns of `Lights`, and what follows from them.

    Attributes
    ----------
    seen : (6, l) bool
        Whose light surfaces scatter by the lobes that rays of each `RayKind` follow.
    versine : (l,) float32
        1 − cos of half of `angle`, with all the digits of narrow cones.
    reach : (l,) float32, m
        Radius of a ball around the lamp; of suns, the sine of half of `angle`.
    tan_spread, spread_gap, sin2_spread : (l,) float32
        Of area lamps, see `area.spread_columns`.
    has_size : (l,) bool
        Rays can meet the lamp.
    illuminates : (l, o) bool
        (0, 0) where every lamp lights all.
    patterns : PatternArrays
        What nodes do to their light.
    """

    kind: np.ndarray
    emission: np.ndarray
    position: np.ndarray
    axis_x: np.ndarray
    axis_y: np.ndarray
    direction: np.ndarray
    size: np.ndarray
    radius: np.ndarray
    sphere: np.ndarray
    blend: np.ndarray
    stretch: np.ndarray
    seen: np.ndarray
    versine: np.ndarray
    reach: np.ndarray
    tan_spread: np.ndarray
    spread_gap: np.ndarray
    sin2_spread: np.ndarray
    has_size: np.ndarray
    illuminates: np.ndarray
    patterns: PatternArrays


def lamp_arrays(lights: Lights) -> LampArrays:
    """The arrays of a scene's lamps."""
    f, b = np.float32, np.bool_
    dtypes = {"kind": np.int32, "sphere": b}
    columns = {name: kernel_array(getattr(lights, name), dtypes.get(name, f)) for name in LampArrays._fields[:11]}
    linked = np.zeros((0, 0), b) if lights.illuminates is None else lights.illuminates
    half, is_sun = lights.angle.astype(np.float64) / 2, lights.kind == LightKind.SUN
    reach = np.where(is_sun, np.sin(half), lights.radius + np.linalg.norm(lights.size, axis=1) / 2)
    return LampArrays(
        **columns,
        seen=np.stack([lights.seen_by(kind) for kind in RayKind]),
        versine=(2 * np.sin(half / 2) ** 2).astype(f),
        reach=reach.astype(f),
        **spread_columns(lights.spread),
        has_size=kernel_array(has_size(lights), b),
        illuminates=kernel_array(linked, b),
        patterns=pattern_arrays(lights),
    )


def has_size(lights: Lights) -> np.ndarray:
    """Which lamps rays can meet, (l,) bool."""
    return lights.met_by_rays & _extended(lights)


def _extended(lights: Lights) -> np.ndarray:
    extended: np.ndarray = (
        (lights.radius > 0) | (lights.size > 0).all(axis=1) | ((lights.kind == LightKind.SUN) & (lights.angle > 0))
    )
    return extended


@routine
def sample_lamp(lamps, lamp, position, normal, u, v, far):
    """A point of a lamp, and the irradiance from it over the density that it is drawn with: its mean is the lamp's.

    `far` is how far away suns are, m. For `normal` see `cosine_at`.
    """
    kind = lamps.kind[lamp]
    if normal != BLACK and _below_horizon(lamps, lamp, position, normal):
        return position, BLACK
    if kind == _POINT:
        target, way, share = sample_point(lamps, lamp, position, u, v)
    elif kind == _SPOT:
        target, way, share = sample_spot(lamps, lamp, position, u, v)
    elif kind == _SUN:
        target, way, share = sample_sun(lamps, lamp, position, u, v, far)
    else:
        target, way, share = sample_area(lamps, lamp, position, u, v)
    emission = emission_towards(lamps, lamp, target, negative(way), length(minus(target, position)))
    return target, times(emission, share * max(cosine_at(normal, way), ZERO))


@part
def cosine_at(normal, way):
    """What of the light from a direction counts at a surface, or in the air, where the normal is 0 and all counts."""
    return ONE if normal == BLACK else dot(way, normal)


@part
def _below_horizon(lamps, lamp, position, normal):
    """Whether a lamp lies behind the surface of a position, as about half of all do."""
    if lamps.kind[lamp] == _SUN:
        return dot(row(lamps.direction, lamp), normal) >= lamps.reach[lamp]
    return dot(minus(row(lamps.position, lamp), position), normal) <= -lamps.reach[lamp]


@routine
def meet_lamp(lamps, lamp, origin, direction):
    """Where a ray meets a lamp: the distance (infinite where it misses), the radiance, and the density.

    The density, 1/sr, is that with which `sample_lamp` finds the ray's direction from its origin; infinite where the
    lamp is missed.
    """
    kind, met = lamps.kind[lamp], False
    distance = share = density = _INFINITY
    if not lamps.has_size[lamp]:
        return _INFINITY, BLACK, _INFINITY
    if kind == _POINT:
        met, distance, share, density = meet_point(lamps, lamp, origin, direction)
    elif kind == _SPOT:
        met, distance, share, density = meet_spot(lamps, lamp, origin, direction)
    elif kind == _SUN:
        met, distance, share, density = meet_sun(lamps, lamp, direction)
    else:
        met, distance, share, density = meet_area(lamps, lamp, origin, direction)
    if not met:
        return _INFINITY, BLACK, _INFINITY
    emission = emission_towards(lamps, lamp, along(origin, distance, direction), negative(direction), distance)
    return distance, times(emission, share), density


@routine
def radiance_of_lamps(lamps, origin, direction, distance, kind, object_, least_density):
    """Radiance of all lamps that a ray meets before a distance, W/(m² sr).

    Lamps may be hidden from rays of a kind (`RayKind`), and from the object (−1: none) that the ray starts
    from. Lamps whose density (`meet_lamp`) is not below `least_density` are left out.
    """
    radiance = BLACK
    for lamp in range(len(lamps.kind)):
        if lamps.seen[kind, lamp] and lamps.has_size[lamp] and lights_object(lamps, lamp, object_):
            away, light, density = meet_lamp(lamps, lamp, origin, direction)
            if away < distance and density < least_density:
                radiance = plus(radiance, light)
    return radiance


@part
def lights_object(lamps, lamp, object_):
    """Whether a lamp lights an object of the scene; what is no object (−1) is lit by all."""
    return len(lamps.illuminates) == 0 or object_ < 0 or lamps.illuminates[lamp, object_]
