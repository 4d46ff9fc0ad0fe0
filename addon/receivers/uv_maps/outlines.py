"""The outlines of charts in blocks of texels: what each takes of an image, wherever it lies."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...core.ranges import repeat_ranges_in_chunks

if TYPE_CHECKING:
    from .packing import Piece

BLOCK = 4
"""Sides of images, and places of charts, are multiples of it, texels: graphics cards compress blocks of 4 × 4."""

_ANGLES = 12  # that charts are turned by in a quarter, to lie in the smallest box
_STRAIGHT = 0.99  # a box along a chart's longest edge may be so much larger than the smallest
_PAIRS = 1 << 16  # of an edge and a column in a chunk
_LEAST = 2e-3  # of a texel: charts stay so far off the texels beside them, whatever rounding adds


@dataclass(frozen=True)
class Outlines:
    """The charts of pieces, k in all, each in a box of its own.

    Attributes
    ----------
    size : (k, 2) int64
        Width and height of the box, blocks.
    turns : (k,) bool
        Whether the chart may be turned; then its box is not wider than high.
    of_chart : list of (c,) int64
        For each piece, the chart of its corners among all.
    place : list of (c, 2) float64
        Their places in the box, texels.
    first : (k + 1,) int64
        Where the columns of each chart's box begin in the next.
    bottom, top : (n,) int64
        Lowest block that a chart takes in each column of its box, and the first one above.
    """

    size: np.ndarray
    turns: np.ndarray
    of_chart: list[np.ndarray]
    place: list[np.ndarray]
    first: np.ndarray
    bottom: np.ndarray
    top: np.ndarray

    @staticmethod
    def of(pieces: "Sequence[Piece]", density: float, ring: int, check: Callable[[], None]) -> "Outlines":
        """The charts of pieces at a density, with `ring` texels around each."""
        charts = _Charts.of(pieces, density, check)
        place, chart = _turned(charts, check), charts.chart
        check()
        place, extent = from_zero(place, chart, charts.n)
        check()
        place, extent = _whole(place, extent, chart)
        check()
        wide = charts.turns & (extent[:, 0] > extent[:, 1])
        across = wide[chart]
        place[across] = np.stack([place[across, 1], extent[chart[across], 0] - place[across, 0]], axis=1)
        extent[wide] = extent[wide, ::-1]
        place += ring
        size = -(-(extent + 2 * ring) // BLOCK).astype(np.int64)
        check()
        first = np.cumsum([0, *size[:, 0]])
        bottom, top = _profiles(place, charts, first, size, ring, check)
        splits = np.cumsum([len(piece.uv) for piece in pieces])[:-1]
        return Outlines(
            size=size,
            turns=charts.turns,
            of_chart=np.split(chart, splits),
            place=np.split(place, splits),
            first=first,
            bottom=bottom,
            top=top,
        )

    @property
    def n_blocks(self) -> int:
        """That all charts take."""
        return int((self.top - self.bottom).sum())

    def profile(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Lowest block and the first one above, in each column of a chart's box."""
        own = slice(self.first[k], self.first[k + 1])
        return self.bottom[own], self.top[own]

    def blocks_of(
        self, chosen: np.ndarray, place: np.ndarray, flipped: np.ndarray, shape: tuple[int, int]
    ) -> np.ndarray:
        """Which blocks of an image (width, height) some charts take at their places, (height, width) bool."""
        steps = np.zeros((shape[1] + 1, shape[0]), np.int32)
        chart = np.repeat(np.arange(len(self.size)), self.size[:, 0])
        column = np.arange(len(chart)) - self.first[chart]
        mine = np.flatnonzero(np.isin(chart, chosen))
        chart, column, low, high = chart[mine], column[mine], self.bottom[mine], self.top[mine]
        width, height = self.size[chart].T
        turned = flipped[chart]
        column = np.where(turned, width - 1 - column, column) + place[chart, 0]
        low, high = np.where(turned, height - high, low), np.where(turned, height - low, high)
        np.add.at(steps, (place[chart, 1] + low, column), 1)
        np.add.at(steps, (place[chart, 1] + high, column), -1)
        return np.cumsum(steps, axis=0)[:-1] > 0

    def placed(self, place: np.ndarray, flipped: np.ndarray, shape: tuple[int, int]) -> list[np.ndarray]:
        """Texture coordinates of each piece's corners, (c, 2) float32, with charts at places in an image, blocks."""
        found = []
        for chart, at in zip(self.of_chart, self.place, strict=True):
            inside = np.where(flipped[chart, None], self.size[chart] * BLOCK - at, at)
            found.append(((inside + place[chart] * BLOCK) / (np.array(shape) * BLOCK)).astype(np.float32))
        return found


@dataclass(frozen=True)
class _Charts:
    """The charts of pieces, n in all, with the corners of all their faces in a row, c, and the edges of borders, e.

    Attributes
    ----------
    n : int
    turns : (n,) bool
    place : (c, 2) float64, texels
    chart : (c,) int64
        Of each corner.
    edges : (e, 2) int64
        Corners.
    """

    n: int
    turns: np.ndarray
    place: np.ndarray
    chart: np.ndarray
    edges: np.ndarray

    @staticmethod
    def of(pieces: "Sequence[Piece]", density: float, check: Callable[[], None]) -> "_Charts":
        columns, turns, n, n_corners = [], [], 0, 0
        for piece in pieces:
            check()
            used, number = np.unique(piece.chart, return_inverse=True)
            check()
            edges = piece.edges.astype(np.int64) + n_corners
            turns.append(np.full(len(used), piece.turns))
            columns.append((piece.uv.astype(np.float64) * density, number.reshape(-1) + n, edges))
            n, n_corners = n + len(used), n_corners + len(piece.uv)
        return _Charts(n, np.concatenate(turns), *map(np.concatenate, zip(*columns, strict=True)))


def _turned(charts: _Charts, check: Callable[[], None]) -> np.ndarray:
    """Places (c, 2) with each chart turned so that its box is small: along its longest edge, or nearly the best."""
    chart = charts.chart[charts.edges[:, 0]]
    start, end = charts.place[charts.edges[:, 0]], charts.place[charts.edges[:, 1]]
    length = ((end - start) ** 2).sum(axis=1)
    check()
    by_chart = np.lexsort([length, chart])
    starts = np.searchsorted(chart[by_chart], np.arange(charts.n))
    longest = (end - start)[by_chart[np.append(starts[1:], len(chart)) - 1]]
    along = np.arctan2(longest[:, 1], longest[:, 0])
    best, smallest = np.zeros(charts.n), np.full(charts.n, np.inf)
    for step in range(_ANGLES):
        check()
        angle = along + step * np.pi / 2 / _ANGLES
        x, y = _rotated(start, -angle[chart])
        box = [np.maximum.reduceat(a[by_chart], starts) - np.minimum.reduceat(a[by_chart], starts) for a in (x, y)]
        area = box[0] * box[1] * (_STRAIGHT if step == 0 else 1)
        better = area < smallest
        best[better], smallest[better] = angle[better], area[better]
    best[~charts.turns] = 0
    return np.stack(_rotated(charts.place, -best[charts.chart]), axis=1)


def _rotated(place: np.ndarray, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates x and y of places (c, 2) turned by angles (c,)."""
    cos, sin = np.cos(angle), np.sin(angle)
    return place[:, 0] * cos - place[:, 1] * sin, place[:, 0] * sin + place[:, 1] * cos


def from_zero(place: np.ndarray, chart: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Places (c, 2) less the least of their chart, and the charts' extents (n, 2)."""
    low, high = np.full((n, 2), np.inf), np.full((n, 2), -np.inf)
    for axis in range(2):
        np.minimum.at(low[:, axis], chart, place[:, axis])
        np.maximum.at(high[:, axis], chart, place[:, axis])
    return place - low[chart], high - low


def _whole(place: np.ndarray, extent: np.ndarray, chart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places and extents of charts that are stretched to end with a texel."""
    whole = np.maximum(np.ceil(extent - _LEAST), 1)
    stretch = np.where(extent > 0, (whole - 2 * _LEAST) / np.where(extent > 0, extent, 1), 1)
    return place * stretch[chart] + _LEAST, whole


def _profiles(
    place: np.ndarray,
    charts: _Charts,
    first: np.ndarray,
    size: np.ndarray,
    ring: int,
    check: Callable[[], None],
) -> tuple[np.ndarray, np.ndarray]:
    """Lowest block that edges with `ring` texels around them take in each column of their box, and the first above."""
    edge_chart = charts.chart[charts.edges[:, 0]]
    chart_of_column = np.repeat(np.arange(len(size)), size[:, 0])
    low, high = size[chart_of_column, 1].copy(), np.zeros(int(first[-1]), np.int64)
    a, b = place[charts.edges[:, 0]], place[charts.edges[:, 1]]
    swap = a[:, 0] > b[:, 0]
    a, b = np.where(swap[:, None], b, a), np.where(swap[:, None], a, b)
    from_column = np.floor((a[:, 0] + _LEAST - ring) / BLOCK).astype(np.int64)
    to_column = np.ceil((b[:, 0] - _LEAST + ring) / BLOCK).astype(np.int64)
    width = size[edge_chart, 0]
    from_column, to_column = np.clip(from_column, 0, width - 1), np.clip(to_column, 1, width)
    for edge, step in repeat_ranges_in_chunks(np.maximum(to_column - from_column, 1), _PAIRS):
        check()
        column = from_column[edge] + step
        left, right = column * BLOCK - ring, (column + 1) * BLOCK + ring
        run = np.maximum(b[edge, 0] - a[edge, 0], 1e-12)
        rise = b[edge, 1] - a[edge, 1]
        y = [a[edge, 1] + np.clip((x - a[edge, 0]) / run, 0, 1) * rise for x in (left, right)]
        lowest, highest = np.minimum(*y), np.maximum(*y)
        at = first[edge_chart[edge]] + column
        np.minimum.at(low, at, np.floor((np.floor(lowest + _LEAST) - ring) / BLOCK).astype(np.int64))
        np.maximum.at(high, at, np.ceil((np.ceil(highest - _LEAST) + ring) / BLOCK).astype(np.int64))
    low, high = np.maximum(low, 0), np.minimum(high, size[chart_of_column, 1])
    return np.minimum(low, high - 1), np.maximum(high, low + 1)
