"""What triangles cover of the texels of an image, exactly.

Lengths are in texels: texel (row, column) is the square from (column, row) to (column + 1, row + 1).
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...core.compiling import kernel, kernel_array, part
from ...core.parallel import Workers, slices
from ...core.ranges import repeat_ranges_in_chunks

_TRIANGLES = 1 << 12  # in a chunk
_CHUNK = 1 << 16  # pairs of a triangle and a texel
_PAIR_BYTES = 100
_MOST_CORNERS = 16  # of a triangle that is cut to a square
_LEAST_WAY = 1e-3  # texels from a triangle's edges along rows, and from its ends across
_LEAST = 1e-12  # texels: area of an overlap that rounding alone makes


class Fragments(NamedTuple):
    """f overlaps of a triangle with a texel, or with a cell of one.

    Attributes
    ----------
    triangle : (f,) int32
    texel : (f, 2) int32
        Column and row.
    cell : (f,) int32
        Which cell of the texel; 0 where texels are not cut.
    area : (f,) float64
        Of the overlap, in texels.
    middle : (f, 2) float64
        Its centroid, in texels from the image's corner.
    """

    triangle: np.ndarray
    texel: np.ndarray
    cell: np.ndarray
    area: np.ndarray
    middle: np.ndarray

    def where(self, chosen: np.ndarray | slice) -> "Fragments":
        """The fragments that a mask, an index array or a slice chooses."""
        return Fragments(*(column[chosen] for column in self))

    @staticmethod
    def join(parts: "list[Fragments]") -> "Fragments":
        """All fragments of several `Fragments`, in order."""
        return Fragments(*(np.concatenate(columns) for columns in zip(Fragments.room(0), *parts, strict=True)))

    @staticmethod
    def room(n: int) -> "Fragments":
        """Room for n fragments."""
        triangle, cell = np.empty((2, n), np.int32)
        return Fragments(triangle, np.empty((n, 2), np.int32), cell, np.empty(n), np.empty((n, 2)))


def texels_of(corners: np.ndarray, sizes: np.ndarray, workers: Workers) -> Fragments:
    """Every overlap of the triangles with texels.

    Parameters
    ----------
    corners : (t, 3, 2) float64
        Of the triangles, in texels; either way round.
    sizes : (t, 2) int
        Width and height of each triangle's image, in texels; what lies outside is left out.
    """
    corners, sizes = kernel_array(corners, np.float64), kernel_array(sizes, np.int64)
    room = max(_CHUNK, int(sizes.max(initial=0)))

    def overlaps(chunk: slice) -> Fragments:
        place, parts = np.array([chunk.start, -1]), []
        while place[0] < chunk.stop:
            workers.progress.check()
            found = Fragments.room(room)
            n = _find_texels(corners, sizes, chunk.stop, place, _polygons(), found)
            parts.append(Fragments(*(column[:n].copy() for column in found)))
        return Fragments.join(parts)

    return _joined(workers.map(overlaps, slices(len(corners), _TRIANGLES), room * _PAIR_BYTES), workers)


def cells_of(corners: np.ndarray, fragments: Fragments, n: int, workers: Workers) -> Fragments:
    """What the same triangles cover of the n × n cells of the same texels."""
    corners = kernel_array(corners, np.float64)

    def overlaps(chunk: slice) -> Fragments:
        some = fragments.where(chunk)
        found = Fragments.room(len(some.triangle) * n * n)
        n_found = _find_cells(corners, some, n, _polygons(), found)
        return found.where(slice(n_found))

    chunks = slices(len(fragments.triangle), _CHUNK // (n * n) + 1)
    return _joined(workers.map(overlaps, chunks, _CHUNK * _PAIR_BYTES), workers)


def _joined(parts: Iterator[Fragments], workers: Workers) -> Fragments:
    """All fragments, of which parts may be many."""
    joined = []
    for fragments in parts:
        workers.progress.check()
        joined.append(fragments)
    return Fragments.join(joined)


def _polygons() -> np.ndarray:
    """Room for two polygons, in which kernels cut triangles."""
    return np.empty((2, _MOST_CORNERS, 2))


def middles_in(corners: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Chunks of pairs of a triangle (p,) and a texel (p, 2) whose middle lies inside of it, `_LEAST_WAY` at least.

    Parameters
    ----------
    corners : (t, 3, 2) float64
        In texels, as in `texels_of`, and inside of the image.
    """
    a, b = corners, corners[:, [1, 2, 0]]
    low = np.ceil(corners[..., 1].min(axis=1) + _LEAST_WAY - 0.5).astype(np.int64)
    high = np.floor(corners[..., 1].max(axis=1) - _LEAST_WAY - 0.5).astype(np.int64)
    for triangle, step in repeat_ranges_in_chunks(np.maximum(high - low + 1, 0), _CHUNK):
        row = low[triangle] + step
        rise = (b[triangle] - a[triangle])[..., 1]
        t = (row[:, None] + 0.5 - a[triangle, :, 1]) / np.where(rise == 0, np.nan, rise)
        x = a[triangle, :, 0] + np.where((t >= 0) & (t <= 1), t, np.nan) * (b[triangle] - a[triangle])[..., 0]
        left = np.ceil(np.nan_to_num(np.fmin.reduce(x, axis=1), nan=1.0) + _LEAST_WAY - 0.5).astype(np.int64)
        right = np.floor(np.nan_to_num(np.fmax.reduce(x, axis=1), nan=0.0) - _LEAST_WAY - 0.5).astype(np.int64)
        for k, across in repeat_ranges_in_chunks(np.maximum(right - left + 1, 0), _CHUNK):
            yield triangle[k].astype(np.int32), np.stack([left[k] + across, row[k]], axis=1).astype(np.int32)


@kernel
def _find_texels(corners, sizes, end, place, polygons, found):
    """Overlaps of triangles with texels, row by row, as long as there is room for another row; how many.

    Parameters
    ----------
    end : int
        The triangle to stop before.
    place : (2,) int64
        The triangle that is next, and its row that is; −1: its first.
    """
    n = 0
    while place[0] < end:
        t = place[0]
        y = corners[t, 0, 1], corners[t, 1, 1], corners[t, 2, 1]
        first = np.int64(np.floor(max(min(y[0], min(y[1], y[2])), 0.0)))
        last = np.int64(np.ceil(min(max(y[0], max(y[1], y[2])), np.float64(sizes[t, 1]))))
        row = max(first, place[1])
        while row < last:
            if n + sizes[t, 0] > len(found.area):
                place[1] = row
                return n
            left, right = _span(corners[t], row)
            start, stop = max(np.floor(left), 0.0), min(np.ceil(right), np.float64(sizes[t, 0]))
            for column in range(np.int64(start), np.int64(stop)):
                n = _add_overlap(corners, t, column, row, 0, 1, polygons, found, n)
            row += 1
        place[0], place[1] = t + 1, -1
    return n


@kernel
def _find_cells(corners, fragments, n_cells, polygons, found):
    """Overlaps of the triangles of fragments with the cells of their texels; how many."""
    n = 0
    for k in range(len(fragments.triangle)):
        t, column, row = fragments.triangle[k], fragments.texel[k, 0], fragments.texel[k, 1]
        for cell in range(n_cells * n_cells):
            n = _add_overlap(corners, t, column, row, cell, n_cells, polygons, found, n)
    return n


@part
def _span(corners, row):
    """Least and largest x of a triangle (3, 2) within the row y to y + 1; 0 and 0 where it is not."""
    left, right = np.inf, -np.inf
    for k in range(3):
        ax, ay, bx, by = corners[k, 0], corners[k, 1], corners[(k + 1) % 3, 0], corners[(k + 1) % 3, 1]
        if min(ay, by) <= row + 1 and max(ay, by) >= row:
            # Where the edge passes the row's borders, kept to the edge
            level = abs(by - ay) < 1e-300
            rise = 1.0 if level else by - ay
            x0 = ax if level else ax + min(max((row - ay) / rise, 0.0), 1.0) * (bx - ax)
            x1 = bx if level else ax + min(max((row + 1 - ay) / rise, 0.0), 1.0) * (bx - ax)
            left, right = min(left, min(x0, x1)), max(right, max(x0, x1))
    return (left, right) if left <= right else (0.0, 0.0)


@part
def _add_overlap(corners, triangle, column, row, cell, n_cells, polygons, found, n):
    """Write the overlap of a triangle with a cell of a texel as the n-th, if it has an area; how many there are."""
    x, y = column + (cell % n_cells) / n_cells, row + (cell // n_cells) / n_cells
    area, u, v = _overlap(corners[triangle], x, y, n_cells, polygons)
    if area <= _LEAST:
        return n
    found.triangle[n], found.texel[n, 0], found.texel[n, 1], found.cell[n] = triangle, column, row, cell
    found.area[n] = area / (n_cells * n_cells)
    found.middle[n, 0], found.middle[n, 1] = x + u / n_cells, y + v / n_cells
    return n + 1


@part
def _overlap(corners, x, y, per_texel, polygons):
    """Area and centroid, in its sides, of what a triangle shares with the square at (x, y) of side 1/`per_texel`."""
    polygon = polygons[0]
    for k in range(3):
        polygon[k, 0], polygon[k, 1] = (corners[k, 0] - x) * per_texel, (corners[k, 1] - y) * per_texel
    if _holds_square(polygon):
        return 1.0, 0.5, 0.5
    # Cut to each side of the square in turn (Sutherland and Hodgman 1974)
    n = _cut(polygons[0], 3, 0, 1.0, 0.0, polygons[1])
    n = _cut(polygons[1], n, 0, -1.0, 1.0, polygons[0])
    n = _cut(polygons[0], n, 1, 1.0, 0.0, polygons[1])
    n = _cut(polygons[1], n, 1, -1.0, 1.0, polygons[0])
    return _area_and_centroid(polygons[0], n)


@part
def _holds_square(corners):
    """Whether the unit square lies within a triangle."""
    turn = 0.0
    for k in range(3):
        ax, ay = corners[k, 0], corners[k, 1]
        ex, ey = corners[(k + 1) % 3, 0] - ax, corners[(k + 1) % 3, 1] - ay
        if k == 0:
            cx, cy = corners[2, 0] - ax, corners[2, 1] - ay
            turn = np.sign(ex * cy - ey * cx)
        # The least that a corner of the square lies to the left of the edge
        least = turn * (ey * ax - ex * ay) + min(turn * ex, 0.0) + min(-turn * ey, 0.0)
        if turn == 0 or least < 0:
            return False
    return True


@part
def _cut(polygon, n, axis, sign, offset, kept):
    """Write what of a convex polygon of n corners lies where sign · x + offset ≥ 0; how many corners that has."""
    m = 0
    for k in range(n):
        following = k + 1 if k + 1 < n else 0
        a, b = sign * polygon[k, axis] + offset, sign * polygon[following, axis] + offset
        if a >= 0:
            kept[m, 0], kept[m, 1] = polygon[k, 0], polygon[k, 1]
            m += 1
        if (a >= 0) != (b >= 0):
            t = a / (a - b)
            kept[m, 0] = polygon[k, 0] + t * (polygon[following, 0] - polygon[k, 0])
            kept[m, 1] = polygon[k, 1] + t * (polygon[following, 1] - polygon[k, 1])
            m += 1
    return m


@part
def _area_and_centroid(polygon, n):
    """Of a polygon of n corners, either way round; the centroid is kept to the unit square."""
    total = u = v = 0.0
    for k in range(1, n - 1):
        ax, ay = polygon[k, 0] - polygon[0, 0], polygon[k, 1] - polygon[0, 1]
        bx, by = polygon[k + 1, 0] - polygon[0, 0], polygon[k + 1, 1] - polygon[0, 1]
        twice = ax * by - ay * bx
        total, u, v = total + twice, u + (ax + bx) * twice, v + (ay + by) * twice
    if total == 0:
        return 0.0, 0.5, 0.5
    u, v = polygon[0, 0] + u / (3 * total), polygon[0, 1] + v / (3 * total)
    return abs(total) / 2, min(max(u, 0.0), 1.0), min(max(v, 0.0), 1.0)
