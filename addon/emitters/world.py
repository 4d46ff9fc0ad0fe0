"""The world: radiance L from all directions, more photons and samples from where a picture is brighter.

A picture is equirectangular, as Cycles maps it: a table over directions of the world's own frame.
"""

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from ..core.compiling import by_reference, part, routine
from ..core.sampling.pixel_tables import PixelTables, drawn_direction, no_tables, pixel_tables, pixel_towards
from ..core.sampling.warps import uniform_sphere
from ..core.vec3 import BLACK, mul, negative, row, times
from ..scene import RayKind, World
from .aiming.discs import Discs, through_discs
from .row import WORLD, SourceRow

_TINY = np.float32(1e-30)
_EVEN_PDF = np.float32(1 / (4 * np.pi))


@by_reference
class WorldArrays(NamedTuple):
    """A world as kernels take it.

    Attributes
    ----------
    color : triple
        The radiance, or what the picture is multiplied by.
    height : int
        Of the picture; 0 without one.
    picture : PixelTables
        Its one table, drawn by the mean of |L| over colours; none without a picture.
    seen : (6,) bool
        By rays of each `RayKind`.
    """

    color: tuple
    height: int
    picture: PixelTables
    seen: np.ndarray


_KNOWN: WeakKeyDictionary[World, WorldArrays] = WeakKeyDictionary()


def world_arrays(world: World) -> WorldArrays:
    """The arrays of a world; they are made once."""
    if world not in _KNOWN:
        _KNOWN[world] = _arrays(world)
    return _KNOWN[world]


def _arrays(world: World) -> WorldArrays:
    red, green, blue = (np.float32(c) for c in world.color)
    seen = np.array([kind not in world.hidden_from for kind in RayKind])
    if world.image is None:
        return WorldArrays((red, green, blue), 0, no_tables(), seen)
    brightness = (np.abs(world.image) @ (np.abs(world.color) / 3)).astype(np.float64)
    picture = pixel_tables(world.image[None], brightness[None], np.array([np.pi]))
    return WorldArrays((red, green, blue), picture.height, picture, seen)


def world_row(world: World, discs: Discs) -> SourceRow:
    """How the world emits photons; its power is what enters the region of the receivers."""
    return SourceRow(WORLD, -1, (8, 8, 8, 8, len(discs.radii) + 1), world.integral * discs.area_of_region)


@routine
def emit_world(emitters, source, u):
    """A direction by radiance, a place by the nested discs."""
    towards, radiance, pdf = sample_world(emitters.world, u[0], u[1])
    direction = negative(towards)
    origin, area = through_discs(emitters, source, direction, u)
    return origin, direction, times(radiance, area / max(pdf, _TINY))


@routine
def world_towards(world, direction):
    """Radiance from a direction, and the density of `sample_world` there by solid angle."""
    if world.height == 0:
        return world.color, _EVEN_PDF
    return _of_pixel(world, pixel_towards(world.picture, 0, direction))


@part
def world_seen(world, direction, kind):
    """Radiance that a ray of a `RayKind` sees in a direction."""
    return world_towards(world, direction)[0] if world.seen[kind] else BLACK


@routine
def sample_world(world, u, v):
    """A direction, more where the world is bright, the radiance from there, and the density by solid angle."""
    if world.height == 0:
        return uniform_sphere(u, v), world.color, _EVEN_PDF
    direction, pixel = drawn_direction(world.picture, 0, u, v)
    radiance, pdf = _of_pixel(world, pixel)
    return direction, radiance, pdf


@part
def _of_pixel(world, pixel):
    return mul(world.color, row(world.picture.values, pixel)), world.picture.density[pixel]
