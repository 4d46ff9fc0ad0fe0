"""The world: radiance L from all directions, more photons and samples from where a picture is brighter.

A picture is equirectangular, as Cycles maps it. Its directions are drawn by brightness: a row of pixels, then a pixel
in it, then a direction uniform by solid angle within the pixel.
"""

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from ..core.compiling import by_reference, kernel_array, part, routine
from ..core.sampling.cutpoint_table import CutpointTable, cutpoint_table, drawn_place
from ..core.sampling.warps import PI, TWO_PI, uniform_sphere
from ..core.vec3 import ONE, ZERO, mul, negative, row, times
from ..scene import World
from .aiming.discs import Discs, through_discs
from .row import WORLD, SourceRow

_HALF, _TINY = np.float32(0.5), np.float32(1e-30)
_EVEN_PDF = np.float32(1 / (4 * np.pi))


@by_reference
class WorldArrays(NamedTuple):
    """A world as kernels take it.

    Attributes
    ----------
    color : triple
        The radiance, or what the picture is multiplied by.
    height, width : int
        Of the picture; 0 without one.
    pixels : (height width, 3) float32
    density : (height width,) float32, 1/sr
        With which directions of each pixel are drawn, proportional to the mean of |L| over colours.
    z : (height + 1,) float64
        Heights of the edges of rows of pixels.
    rows, columns : CutpointTable
        Of rows, and of the pixels in each row.
    """

    color: tuple
    height: int
    width: int
    pixels: np.ndarray
    density: np.ndarray
    z: np.ndarray
    rows: CutpointTable
    columns: CutpointTable


_KNOWN: WeakKeyDictionary[World, WorldArrays] = WeakKeyDictionary()


def world_arrays(world: World) -> WorldArrays:
    """The arrays of a world; they are made once."""
    if world not in _KNOWN:
        _KNOWN[world] = _arrays(world)
    return _KNOWN[world]


def _arrays(world: World) -> WorldArrays:
    red, green, blue = (np.float32(c) for c in world.color)
    if world.image is None:
        nothing, table = np.zeros(0, np.float32), cutpoint_table(np.zeros((0, 1)))
        return WorldArrays((red, green, blue), 0, 0, np.zeros((0, 3), np.float32), nothing, np.zeros(1), table, table)
    height, width = world.image.shape[:2]
    brightness = (np.abs(world.image) @ (np.abs(world.color) / 3)).astype(np.float64)
    weight = brightness * world.solid_angles[:, None]
    of_row = weight.sum(axis=1)
    columns = np.cumsum(weight, axis=1) / np.maximum(of_row, 1e-300)[:, None]
    columns[:, -1] = 1
    whole = max(of_row.sum(), 1e-300)
    density = (brightness / whole).astype(np.float32).ravel()
    rows, z = cutpoint_table(np.cumsum(of_row)[None] / whole), -np.cos(np.pi * np.arange(height + 1) / height)
    pixels = kernel_array(world.image.reshape(-1, 3), np.float32)
    return WorldArrays((red, green, blue), height, width, pixels, density, z, rows, cutpoint_table(columns))


def world_row(world: World, discs: Discs) -> SourceRow:
    """How the world emits photons; its power is what enters the region of the receivers."""
    return SourceRow(WORLD, -1, (8, 8, 8, 8, len(discs.radii) + 1), world.integral * discs.area_of_region)


@routine
def emit_world(emitters, source, u):
    """A direction by radiance, a place by the nested discs."""
    towards = sample_world(emitters.world, u[0], u[1])
    direction = negative(towards)
    origin, area = through_discs(emitters, source, direction, u)
    share = area / max(world_pdf(emitters.world, towards), _TINY)
    return origin, direction, times(world_radiance(emitters.world, towards), share)


@routine
def world_radiance(world, direction):
    """Radiance from a direction."""
    if world.height == 0:
        return world.color
    return mul(world.color, row(world.pixels, _pixel(world, direction)))


@routine
def sample_world(world, u, v):
    """A direction, more where the world is bright; see `world_pdf`."""
    if world.height == 0:
        return uniform_sphere(u, v)
    line, within_line = drawn_place(world.rows, 0, u)
    column, within_column = drawn_place(world.columns, line, v)
    z = np.float32(world.z[line] + within_line * (world.z[line + 1] - world.z[line]))
    azimuth = PI - TWO_PI * np.float32((column + within_column) / world.width)
    r = np.sqrt(max(ONE - z * z, ZERO))
    return r * np.cos(azimuth), r * np.sin(azimuth), z


@routine
def world_pdf(world, direction):
    """Density of `sample_world` by solid angle."""
    return _EVEN_PDF if world.height == 0 else world.density[_pixel(world, direction)]


@part
def _pixel(world, direction):
    """Number of the pixel that a direction looks at: rows from below, columns along the azimuth π − 2πu of x to y."""
    u = _HALF - np.arctan2(direction[1], direction[0]) / TWO_PI
    v = np.arccos(min(max(-direction[2], -ONE), ONE)) / PI
    line = min(np.int64(v * np.float32(world.height)), world.height - 1)
    return line * world.width + min(np.int64(u * np.float32(world.width)), world.width - 1)
