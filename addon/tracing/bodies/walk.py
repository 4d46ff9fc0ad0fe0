"""A random walk inside of one object, from a point of its surface to another.

Each step draws a distance of one channel's free paths, chosen by what the channels would scatter, and weighs it by the
balance heuristic over channels. After a few scatterings anisotropic ones are taken for isotropic ones of the same
reduced coefficients, as in Cycles, and walks that carry little are ended by Russian roulette. Like Cycles', walks of
more than 256 steps are lost, which darkens deep bodies of nearly white colours; Cycles guides its walks to the surface,
which changes their noise but not their mean.
"""

from typing import NamedTuple

import numpy as np

from ...bsdf.phase import sampling as phase
from ...core.compiling import part, routine
from ...core.sampling.path_numbers import two_numbers
from ...core.vec3 import BLACK, ONE, TWO, ZERO, along, largest, minus, mul, times
from ...scene.hit import off_surface, ray_offset
from ..embree import INFINITY, intersect

MAX_STEPS = 256
N_PAIRS = 3 * MAX_STEPS
"""Pairs of a path's numbers that a walk takes."""

_SIMILAR, _ROULETTE = 9, 8  # steps before scattering is isotropic, and before walks are ended
_MAX_OTHERS = 16  # surfaces of other bodies that a step passes
_TINY = np.float32(1e-30)


class Exit(NamedTuple):
    """Where a walk comes out.

    Attributes
    ----------
    found : bool
        Whether it does.
    triangle, u, v
        Where.
    direction : triple
        Along which it comes to the surface from inside.
    weight : triple
        What is left of it, by the closure's weight.
    """

    found: bool
    triangle: np.int32
    u: np.float32
    v: np.float32
    direction: tuple
    weight: tuple


@part
def no_exit():
    """That of a walk that ends inside."""
    return Exit(False, np.int32(-1), ZERO, ZERO, BLACK, BLACK)


class Coefficients(NamedTuple):
    """σt, σs and g of a step."""

    extinction: tuple
    scattering: tuple
    anisotropy: np.float32


@routine
def walk(scene, tree, room, hit, direction, medium, key, path):
    """Where a walk comes out that enters a body at a hit, along a direction of the world.

    Parameters
    ----------
    tree : uint64
        Embree's, of bodies.
    key, path
        Of the random numbers; the first `N_PAIRS` pairs of the path's are taken.
    """
    position, object_, weight = off_surface(scene, hit, -ONE), scene.object[hit.triangle], medium.weight
    for step in range(MAX_STEPS):
        i, at = 3 * step, coefficients(medium, step)
        if step > 0:
            a, b = two_numbers(key, path, i)
            direction = phase.sample(direction, at.anisotropy, a, b)
        choice, number = two_numbers(key, path, i + 1)
        chances = chances_of(mul(weight, medium.albedo))
        distance = free_path(at, chances, choice, number)
        triangle, far, u, v = _own_surface(scene, tree, room, object_, position, direction, distance)
        if triangle >= 0:
            weight = mul(weight, passed(at, chances, far, False))
            return Exit(True, triangle, u, v, direction, weight)
        position = along(position, distance, direction)
        weight = mul(weight, passed(at, chances, distance, True))
        if largest(weight) <= ZERO:
            break
        if step >= _ROULETTE:
            fate, _ = two_numbers(key, path, i + 2)
            survival = min(TWO * largest(weight) / largest(medium.weight), ONE)
            if fate >= survival:
                break
            weight = times(weight, ONE / survival)
    return no_exit()


@part
def coefficients(medium, step):
    """Those of a step, the first of which is 0."""
    scattering = mul(medium.extinction, medium.albedo)
    if step <= _SIMILAR:
        return Coefficients(medium.extinction, scattering, medium.anisotropy)
    reduced = times(scattering, ONE - medium.anisotropy)
    less = minus(scattering, reduced)
    return Coefficients(minus(medium.extinction, less), reduced, ZERO)


@part
def chances_of(expected):
    """The chance of each channel, by what it would scatter."""
    total = expected[0] + expected[1] + expected[2]
    if total <= _TINY:
        third = ONE / np.float32(3)
        return third, third, third
    return times(expected, ONE / total)


@part
def free_path(at, chances, choice, number):
    """A distance of one channel's, m."""
    extinction = at.extinction[2]
    if choice < chances[0]:
        extinction = at.extinction[0]
    elif choice < chances[0] + chances[1]:
        extinction = at.extinction[1]
    return -np.log(ONE - number) / extinction


@part
def passed(at, chances, distance, scattered):
    """What a step leaves over the density of its distance: e^(−σt d), times σs where it ends in the body."""
    r, g, b = (
        np.exp(-at.extinction[0] * distance),
        np.exp(-at.extinction[1] * distance),
        np.exp(-at.extinction[2] * distance),
    )
    if not scattered:
        density = chances[0] * r + chances[1] * g + chances[2] * b
        return times((r, g, b), ONE / max(density, _TINY))
    e = at.extinction
    density = chances[0] * r * e[0] + chances[1] * g * e[1] + chances[2] * b * e[2]
    return times(mul(at.scattering, (r, g, b)), ONE / max(density, _TINY))


@part
def _own_surface(scene, tree, room, object_, position, direction, far):
    """The first triangle of an object along a ray as far as `far` (−1: none), its distance, u and v."""
    gone = ZERO
    for _ in range(_MAX_OTHERS):
        triangle, distance, u, v = intersect(tree, room, position, direction, far - gone)
        if triangle < 0:
            break
        if scene.object[triangle] == object_:
            return triangle, gone + distance, u, v
        step = distance + ray_offset(scene, triangle, along(position, distance, direction))
        position, gone = along(position, step, direction), gone + step
        if gone >= far:
            break
    return np.int32(-1), INFINITY, ZERO, ZERO
