"""What triangles cover of the texels of an image, exactly.

Lengths are in texels: texel (row, column) is the square from (column, row) to (column + 1, row + 1).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...core.parallel import Workers, slices

_CHUNK = 1 << 16  # pairs of a triangle and a texel
_PAIR_BYTES = 800  # a pair takes while it is cut
_LEAST_WAY = 1e-3  # texels from a triangle's edges along rows, and from its ends across
_LEAST = 1e-12  # texels: area of an overlap that rounding alone makes


@dataclass(frozen=True)
class Fragments:
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

    def where(self, chosen: np.ndarray) -> "Fragments":
        """The fragments that a mask or an index array chooses."""
        return Fragments(*(getattr(self, name)[chosen] for name in self.__dataclass_fields__))

    @staticmethod
    def join(parts: "list[Fragments]") -> "Fragments":
        """All fragments of several `Fragments`, in order."""
        return Fragments(
            *(np.concatenate([getattr(part, name) for part in parts]) for name in Fragments.__dataclass_fields__)
        )

    @staticmethod
    def none() -> "Fragments":
        """No fragments."""
        i, i2, f, f2 = np.zeros(0, np.int32), np.zeros((0, 2), np.int32), np.zeros(0), np.zeros((0, 2))
        return Fragments(i, i2, i, f, f2)


def texels_of(corners: np.ndarray, sizes: np.ndarray, workers: Workers) -> Fragments:
    """Every overlap of the triangles with texels.

    Parameters
    ----------
    corners : (t, 3, 2) float64
        Of the triangles, in texels; either way round.
    sizes : (t, 2) int
        Width and height of each triangle's image, in texels; what lies outside is left out.
    """

    def overlaps(pairs: tuple[np.ndarray, np.ndarray]) -> Fragments:
        triangle, texel = pairs
        return _fragments(corners, triangle, texel, np.zeros(len(texel), np.int32), 1)

    return _joined(workers.map(overlaps, _touched(corners, sizes), _CHUNK * _PAIR_BYTES), workers)


def cells_of(corners: np.ndarray, fragments: Fragments, n: int, workers: Workers) -> Fragments:
    """What the same triangles cover of the n × n cells of the same texels."""

    def overlaps(chunk: slice) -> Fragments:
        triangle, texel = fragments.triangle[chunk], fragments.texel[chunk]
        cell = np.tile(np.arange(n * n, dtype=np.int32), len(triangle))
        return _fragments(corners, np.repeat(triangle, n * n), np.repeat(texel, n * n, axis=0), cell, n)

    chunks = slices(len(fragments.triangle), _CHUNK // (n * n) + 1)
    return _joined(workers.map(overlaps, chunks, _CHUNK * _PAIR_BYTES), workers)


def _joined(parts: Iterator[Fragments], workers: Workers) -> Fragments:
    """All fragments, of which parts may be many."""
    joined = [Fragments.none()]
    for part in parts:
        workers.progress.check()
        joined.append(part)
    return Fragments.join(joined)


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
    for triangle, step in unrolled(np.maximum(high - low + 1, 0)):
        row = low[triangle] + step
        rise = (b[triangle] - a[triangle])[..., 1]
        t = (row[:, None] + 0.5 - a[triangle, :, 1]) / np.where(rise == 0, np.nan, rise)
        x = a[triangle, :, 0] + np.where((t >= 0) & (t <= 1), t, np.nan) * (b[triangle] - a[triangle])[..., 0]
        left = np.ceil(np.nan_to_num(np.fmin.reduce(x, axis=1), nan=1.0) + _LEAST_WAY - 0.5).astype(np.int64)
        right = np.floor(np.nan_to_num(np.fmax.reduce(x, axis=1), nan=0.0) - _LEAST_WAY - 0.5).astype(np.int64)
        for k, across in unrolled(np.maximum(right - left + 1, 0)):
            yield triangle[k].astype(np.int32), np.stack([left[k] + across, row[k]], axis=1).astype(np.int32)


def unrolled(counts: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Item i `counts[i]` times, with 0, 1, … beside it, in chunks."""
    ends = np.cumsum(counts)
    start, total = 0, int(ends[-1]) if len(ends) else 0
    for chunk in slices(total, _CHUNK):
        k = np.arange(chunk.start, chunk.stop)
        item = np.searchsorted(ends, k, side="right")
        start = ends[item] - counts[item]
        yield item, k - start


def _touched(corners: np.ndarray, sizes: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Chunks of pairs of a triangle (p,) and a texel (p, 2) in its reach: row by row, what the triangle spans there."""
    low = np.maximum(np.floor(corners[..., 1].min(axis=1)), 0).astype(np.int64)
    high = np.minimum(np.ceil(corners[..., 1].max(axis=1)), sizes[:, 1]).astype(np.int64)
    for triangle, step in unrolled(np.maximum(high - low, 0)):
        row = low[triangle] + step
        left, right = _span(corners[triangle], row)
        left = np.maximum(np.floor(left), 0).astype(np.int64)
        right = np.minimum(np.ceil(right), sizes[triangle, 0]).astype(np.int64)
        for k, across in unrolled(np.maximum(right - left, 0)):
            yield triangle[k].astype(np.int32), np.stack([left[k] + across, row[k]], axis=1).astype(np.int32)


def _span(corners: np.ndarray, row: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest x of triangles (n, 3, 2) within the rows y to y + 1 (n,)."""
    a, b = corners, corners[:, [1, 2, 0]]
    rise = b[..., 1] - a[..., 1]
    level = np.abs(rise) < 1e-300
    ends = []
    for y in (row, row + 1):  # where edges pass the row's borders, kept to the edges
        t = np.clip((y[:, None] - a[..., 1]) / np.where(level, 1, rise), 0, 1)
        ends.append(a[..., 0] + np.where(level, 0, t) * (b[..., 0] - a[..., 0]))
    ends.append(np.where(level, b[..., 0], ends[0]))
    # An edge wholly above or below the row is clipped to one of its ends, which may lie beyond the triangle's span
    apart = (np.minimum(a[..., 1], b[..., 1]) > row[:, None] + 1) | (np.maximum(a[..., 1], b[..., 1]) < row[:, None])
    left = np.where(apart, np.inf, np.minimum.reduce(ends)).min(axis=1)
    right = np.where(apart, -np.inf, np.maximum.reduce(ends)).max(axis=1)
    return np.where(np.isfinite(left), left, 0), np.where(np.isfinite(right), right, 0)


def _fragments(corners: np.ndarray, triangle: np.ndarray, texel: np.ndarray, cell: np.ndarray, n: int) -> Fragments:
    """Overlaps of triangles with cells of texels that are cut n × n, less those without any area."""
    low = texel + np.stack([cell % n, cell // n], axis=1) / n
    area, middle = _overlap((corners[triangle] - low[:, None]) * n)
    kept = np.flatnonzero(area > _LEAST)
    return Fragments(triangle[kept], texel[kept], cell[kept], area[kept] / n**2, low[kept] + middle[kept] / n)


def _overlap(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Area (n,) and centroid (n, 2) of what triangles (n, 3, 2) share with the unit square."""
    area, middle = np.ones(len(corners)), np.full((len(corners), 2), 0.5)
    edge = corners[:, [1, 2, 0]] - corners
    turn = np.sign(edge[:, 0, 0] * edge[:, 1, 1] - edge[:, 0, 1] * edge[:, 1, 0])[:, None]
    # The least that a corner of the square lies to the left of an edge
    left = edge[..., 0] * -corners[..., 1] - edge[..., 1] * -corners[..., 0]
    least = turn * left + np.minimum(turn * edge[..., 0], 0) + np.minimum(turn * -edge[..., 1], 0)
    cut = np.flatnonzero((least < 0).any(axis=1) | (turn[:, 0] == 0))
    area[cut], middle[cut] = _area_and_centroid(_clipped(corners[cut]))
    return area, middle


def _clipped(polygon: np.ndarray) -> np.ndarray:
    """Convex polygons (n, k, 2) cut to the unit square (Sutherland and Hodgman 1974), (n, k + 4, 2).

    Unused places repeat a corner, which changes neither area nor centroid.
    """
    for axis in range(2):
        for sign, offset in ((1, 0), (-1, 1)):
            inside = sign * polygon[..., axis] + offset  # how far inside the side
            polygon = np.concatenate([polygon, polygon[:, :1]], axis=1)
            cut = np.flatnonzero(inside.min(axis=1) < 0)
            polygon[cut] = _cut(polygon[cut, :-1], inside[cut])
    return polygon


def _cut(polygon: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Convex polygons (n, k, 2) without what of them lies beyond a line, (n, k + 1, 2).

    Parameters
    ----------
    inside : (n, k)
        How far each corner lies on the line's inner side.
    """
    n, k = inside.shape
    following, inside_next = np.roll(polygon, -1, axis=1), np.roll(inside, -1, axis=1)
    crosses = (inside >= 0) != (inside_next >= 0)
    t = inside / np.where(crosses, inside - inside_next, 1)
    places = np.empty((n, 2 * k, 2))
    places[:, ::2], places[:, 1::2] = polygon, polygon + t[..., None] * (following - polygon)
    used = np.stack([inside >= 0, crosses], axis=2).reshape(n, 2 * k)
    row, place = np.nonzero(used)
    # Rounding may make one crossing too many of a corner on the line
    order = np.minimum(np.cumsum(used, axis=1, dtype=np.int8)[row, place] - 1, k)
    rest = np.repeat(places[np.arange(n), used.argmax(axis=1)][:, None], k + 1, axis=1)
    rest[row, order] = places[row, place]
    return rest


def _area_and_centroid(polygon: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of polygons (n, k, 2), either way round: area (n,), centroid (n, 2)."""
    first = polygon[:, :1]
    a, b = (polygon - first)[:, 1:-1], (polygon - first)[:, 2:]
    twice = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    total = twice.sum(axis=1)
    moment = ((a + b) * twice[..., None]).sum(axis=1) / 3
    centroid = first[:, 0] + moment / np.where(total == 0, 1, total)[:, None]
    return np.abs(total) / 2, np.clip(centroid, 0, 1)
