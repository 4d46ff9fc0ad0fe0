"""Tables of pixels from which places or directions are drawn by their weights: a row, then a pixel in it.

A table over directions has rows of even height in the angle from an axis, the local −z, on: row 0 is around it, and
column u looks along the azimuth π − 2πu of x to y, as Cycles maps equirectangular pictures. A table over the unit
square has rows along y and columns along x.
"""

from typing import NamedTuple

import numpy as np

from ..compiling import by_reference, kernel_array, part
from ..vec3 import ONE, ZERO
from .cutpoint_table import CutpointTable, cutpoint_table, drawn_place
from .warps import PI, TWO_PI

_HALF = np.float32(0.5)


@by_reference
class PixelTables(NamedTuple):
    """t tables of h × w pixels each.

    Attributes
    ----------
    height, width : int
        0 where there are no tables.
    values : (t h w, 3) float32
    density : (t h w,) float32
        With which a place in each pixel is drawn: by solid angle, 1/sr, or by area of the unit square.
    rows_a_radian : (t,) float32
        Of tables over directions.
    z : (t (h + 1),) float64
        Heights of the edges of their rows along the local z.
    rows, columns : CutpointTable
        Of the rows of each table, and of the pixels of each row.
    """

    height: int
    width: int
    values: np.ndarray
    density: np.ndarray
    rows_a_radian: np.ndarray
    z: np.ndarray
    rows: CutpointTable
    columns: CutpointTable


def no_tables() -> PixelTables:
    """No table at all."""
    nothing, table = np.zeros(0, np.float32), cutpoint_table(np.zeros((0, 1)))
    return PixelTables(0, 0, np.zeros((0, 3), np.float32), nothing, nothing, np.zeros(0), table, table)


def pixel_tables(values: np.ndarray, weights: np.ndarray, angles: np.ndarray) -> PixelTables:
    """Tables whose pixels are drawn by a weight times their solid angle, or their area.

    Parameters
    ----------
    values : (t, h, w, 3) float32
    weights : (t, h, w)
        Not below 0.
    angles : (t,) float64, rad
        From the axis to the last row's end, at most π; 0 of tables over the unit square.
    """
    _, height, width = weights.shape
    steps = np.arange(height + 1) / height
    z = -np.cos(angles[:, None] * steps)
    measure = np.where(angles[:, None] > 0, np.diff(z) * (2 * np.pi / width), 1 / (height * width))
    of_pixel = weights * measure[..., None]
    of_row = of_pixel.sum(axis=2)
    columns = np.cumsum(of_pixel, axis=2) / np.maximum(of_row, 1e-300)[..., None]
    columns[..., -1] = 1
    whole = np.maximum(of_row.sum(axis=1, keepdims=True), 1e-300)
    return PixelTables(
        height,
        width,
        kernel_array(values.reshape(-1, 3), np.float32),
        (weights / whole[..., None]).astype(np.float32).ravel(),
        (height / np.where(angles > 0, angles, 1)).astype(np.float32),
        z.ravel(),
        cutpoint_table(np.cumsum(of_row, axis=1) / whole),
        cutpoint_table(columns.reshape(-1, width)),
    )


@part
def drawn_direction(tables, t, u, v):
    """A direction of the frame of table t, drawn with its pixel's density by solid angle, and the pixel's number."""
    line, within_line = drawn_place(tables.rows, t, u)
    column, within_column = drawn_place(tables.columns, t * tables.height + line, v)
    edge = t * (tables.height + 1) + line
    z = np.float32(tables.z[edge] + within_line * (tables.z[edge + 1] - tables.z[edge]))
    azimuth = PI - TWO_PI * np.float32((column + within_column) / tables.width)
    r = np.sqrt(max(ONE - z * z, ZERO))
    pixel = (t * tables.height + line) * tables.width + column
    return (r * np.cos(azimuth), r * np.sin(azimuth), z), pixel


@part
def pixel_towards(tables, t, direction):
    """Number of the pixel of table t that a direction of its frame looks at; −1 where the table has none."""
    z = min(max(direction[2], -ONE), ONE)
    if z > tables.z[(t + 1) * (tables.height + 1) - 1]:
        return np.int64(-1)
    u = _HALF - np.arctan2(direction[1], direction[0]) / TWO_PI
    line = min(np.int64(np.arccos(-z) * tables.rows_a_radian[t]), tables.height - 1)
    column = min(np.int64(u * np.float32(tables.width)), tables.width - 1)
    return (t * tables.height + line) * tables.width + column


@part
def drawn_in_square(tables, t, u, v):
    """A place (x, y) of the unit square, with the density of its pixel of table t by area."""
    line, within_line = drawn_place(tables.rows, t, u)
    column, within_column = drawn_place(tables.columns, t * tables.height + line, v)
    x = np.float32((column + within_column) / tables.width)
    return x, np.float32((line + within_line) / tables.height)


@part
def pixel_in_square(tables, t, x, y):
    """Number of the pixel of table t that a place of the unit square lies in; the nearest of one outside."""
    line = min(max(np.int64(y * np.float32(tables.height)), 0), tables.height - 1)
    column = min(max(np.int64(x * np.float32(tables.width)), 0), tables.width - 1)
    return (t * tables.height + line) * tables.width + column
