"""Photons aimed at what makes caustics: a small glass in a large room gets as many as all the rest.

Jensen's projection maps do this for lamps that are points. Here a source's light is parted in two: what flies towards
the balls around caustic makers, and the rest. Half of the photons sample the one part and half the other, by twice the
power; a photon of the rest that flies towards a ball after all carries none, as the others bring that light.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core.compiling import by_reference, kernel, kernel_array, part
from ...core.sampling.warps import at_versine, uniform_disk
from ...core.vec3 import ONE, TWO, ZERO, dot, length, minus, narrow, plus, put, row, times, to_world, wide

_NARROWEST = 2.0**-41  # versine: nothing is so far away that its cone has no solid angle
_HALF = np.float32(0.5)


@dataclass(frozen=True)
class ProjectionMap:
    """The m balls that photons are aimed at, alike many at each: centre (m, 3) float32 and radius (m,) float32, m."""

    centre: np.ndarray
    radius: np.ndarray


@by_reference
class Balls(NamedTuple):
    """The balls of the projection maps of s sources: those of each from `start` to `stop`, (s,) int32."""

    centre: np.ndarray
    radius: np.ndarray
    start: np.ndarray
    stop: np.ndarray


def balls_of(maps: "list[ProjectionMap | None]") -> Balls:
    """The balls of each source's map; of maps that are one and the same, once."""
    known = {id(one): one for one in maps if one is not None}
    counts = [len(one.radius) for one in known.values()]
    first = dict(zip(known, np.cumsum([0, *counts]).tolist(), strict=False))
    start = np.array([0 if one is None else first[id(one)] for one in maps], np.int32)
    n_balls = np.array([0 if one is None else len(one.radius) for one in maps], np.int32)
    centre = np.concatenate([np.zeros((0, 3), np.float32), *(one.centre for one in known.values())])
    radius = np.concatenate([np.zeros(0, np.float32), *(one.radius for one in known.values())])
    return Balls(centre, radius, start, start + n_balls)


@part
def halved(balls, source, u):
    """Whether a photon is aimed, by its last number, and what is left of the number."""
    if balls.start[source] == balls.stop[source]:
        return False, u
    return (True, TWO * u) if u < _HALF else (False, TWO * u - ONE)


@part
def redirected(balls, source, aimed, u, v, origin, reach, direction, per_density):
    """A photon's direction, into a cone around a ball if it is aimed, and 1 over the density of all, sr.

    `direction` and `per_density` are the photon's if none was aimed; it may start as far as `reach` beside `origin`.
    """
    first, last = balls.start[source], balls.stop[source]
    if first == last:
        return direction, per_density
    if aimed:
        ball, within = _chosen(first, last, u)
        versine, axis = cone_to_ball(row(balls.centre, ball), balls.radius[ball], origin, reach)
        direction = to_world(at_versine(within * versine, v), axis)
    density = 0.0
    for ball in range(first, last):
        versine, axis = cone_to_ball(row(balls.centre, ball), balls.radius[ball], origin, reach)
        aside = minus(direction, axis)
        if 0.5 * np.float64(dot(aside, aside)) <= versine:  # 1 − a·b = |a − b|²/2, with all its digits
            density += 1.0 / (2.0 * np.pi * versine)
    return direction, _parted(aimed, density / (last - first), per_density)


@part
def moved(balls, source, aimed, u, v, place, direction, per_density):
    """A place that parallel light passes, within a ball if the photon is aimed, and 1 over the density of all, m².

    As `redirected`; densities are by area across the rays.
    """
    first, last = balls.start[source], balls.stop[source]
    if first == last:
        return place, per_density
    if aimed:
        ball, within = _chosen(first, last, u)
        x, y = uniform_disk(within, v)
        place = plus(row(balls.centre, ball), times(to_world((x, y, ZERO), direction), balls.radius[ball]))
    density = 0.0
    for ball in range(first, last):
        away, radius = minus(place, row(balls.centre, ball)), balls.radius[ball]
        before = dot(away, direction)
        if dot(away, away) - before * before <= radius * radius:
            density += 1.0 / (np.pi * np.float64(radius) * radius)
    return place, _parted(aimed, density / (last - first), per_density)


@part
def _chosen(first, last, u):
    """A ball, and what is left of the number."""
    steps = u * np.float32(last - first)
    nth = min(np.int32(steps), last - first - 1)
    return first + nth, min(max(steps - np.float32(nth), ZERO), ONE)


@part
def _parted(aimed, density, per_density):
    """1 over a photon's density in its part of the light; 0 of those that strayed."""
    if aimed:
        return np.float32(2.0 / density) if density > 0.0 else ZERO
    return ZERO if density > 0.0 else TWO * np.float32(per_density)


@part
def cone_to_ball(centre, radius, origin, reach):
    """The cone of all lines to a ball from within `reach` of an origin: the versine of half its angle, and its axis.

    The versine 1 − cos (float64, since cones are narrow) is 2 where the origin is too close for a cone.
    """
    way = minus(wide(centre), wide(origin))
    distance = length(way)
    sine = (np.float64(radius) + np.float64(reach)) / max(distance, 1e-30)
    versine = max(sine * sine / (1.0 + np.sqrt(1.0 - sine * sine)), _NARROWEST) if sine < 1.0 else 2.0
    if distance == 0.0:
        return versine, (ZERO, ZERO, ONE)
    return versine, narrow(times(way, 1.0 / distance))


@kernel
def _cones_to_ball(centre, radius, origins, reach, versines, axes):
    for k in range(len(origins)):
        versines[k], axis = cone_to_ball(centre, radius, row(origins, k), reach)
        put(axes, k, axis)


def cones_to_ball(
    centre: np.ndarray | tuple, radius: float, origins: np.ndarray, reach: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """`cone_to_ball` of many origins (n, 3): versines (n,) float64 and axes (n, 3) float32."""
    versines, axes = np.empty(len(origins)), np.empty((len(origins), 3), np.float32)
    x, y, z = (np.float32(c) for c in centre)
    _cones_to_ball((x, y, z), float(radius), kernel_array(origins, np.float32), float(reach), versines, axes)
    return versines, axes
