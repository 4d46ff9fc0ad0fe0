"""Charts packed into images, by their outlines in blocks of texels.

Large charts, the tallest first, slide down onto a horizon and stay where that leaves the least room below them (Lévy,
Petitjean, Ray and Maillot, Least Squares Conformal Maps, 2002, section 4). Small ones then fill whatever blocks are
free, all of one size at once.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np

from .outlines import BLOCK, Outlines

SMALL = 4
"""Blocks that small charts span along each side at most."""

_TRIES = 8  # of a density that fills an image
_WIDTHS = (1.0, 1.08, 1.18)  # of an image that is as wide as needed, times the root of what charts cover
_FEW = 2000  # large charts that are packed once for each of these
_SLICE = 256  # charts between two looks at the progress


@dataclass(frozen=True)
class Piece:
    """What gets a place in an image: charts that are moved and turned each on its own; c corners of faces.

    Attributes
    ----------
    uv : (c, 2) float32, m
        Of the corners, each in its chart.
    chart : (c,) int32
    edges : (e, 2) int32
        Corners at the ends of the charts' borders.
    area : float, m²
        Of all faces, as they are laid flat.
    turns : bool
        Whether its charts may be turned.
    """

    uv: np.ndarray
    chart: np.ndarray
    edges: np.ndarray
    area: float
    turns: bool = True

    @staticmethod
    def rectangle(width: float, height: float) -> "Piece":
        """A rectangle that stays upright, m; its corners are 0 0, 1 0, 1 1 and 0 1."""
        uv = np.array([(0, 0), (width, 0), (width, height), (0, height)], np.float32)
        edges = np.array([(0, 1), (1, 2), (2, 3), (3, 0)], np.int32)
        return Piece(uv, np.zeros(4, np.int32), edges, width * height, turns=False)


@dataclass(frozen=True)
class Packed:
    """An image with pieces.

    Attributes
    ----------
    width, height : int
        Texels, multiples of `BLOCK`.
    uv : list of (c, 2) float32
        Of each piece's corners, in [0, 1].
    density : float
        Texels a metre.
    """

    width: int
    height: int
    uv: list[np.ndarray]
    density: float


PiecesAt = Callable[[float], Sequence[Piece]]
"""The pieces that there are at a density, texels a metre; at 0, such as have the right area."""

Check = Callable[[], None]


def pack(
    pieces: Sequence[Piece], density: float, ring: int, size: int = 0, check: Check = lambda: None
) -> Packed | None:
    """Lay pieces into one image; charts grow a little, so that they end with a texel.

    Parameters
    ----------
    density : float
        Texels a metre.
    ring : int
        Texels around each chart that no other has.
    size : int
        Sides of the image, texels; 0: as few as needed.
    check : callable
        Raises an exception to end this early.

    Returns
    -------
    Packed or None
        None if the pieces do not fit into `size`.
    """
    outlines = Outlines.of(pieces, density, ring, check)
    if size:
        best = _Image.filled(outlines, size // BLOCK, size // BLOCK, check)
    else:
        best = _smallest(outlines, check)
    if best is None:
        return None
    shape = (best.width, best.height) if not size else (size // BLOCK, size // BLOCK)
    places = outlines.placed(best.place, best.flipped, shape)
    return Packed(shape[0] * BLOCK, shape[1] * BLOCK, places, density)


def fill(pieces_at: PiecesAt, size: int, ring: int, check: Check = lambda: None) -> Packed | None:
    """Lay the pieces that there are at a density into an image of `size` texels a side, at the largest that fits."""
    there = pieces_at(0.0)
    area = sum(piece.area for piece in there)
    longest = max((float(np.ptp(piece.uv, axis=0).max(initial=0)) for piece in there if len(piece.uv)), default=0.0)
    highest = size / max(sqrt(area), longest / sqrt(2)) if longest > 0 else 1.0
    density, lowest, best = 0.9 * highest, 0.0, None
    for _ in range(_TRIES):
        packed = pack(pieces_at(density), density, ring, size, check)
        if packed is not None:
            best, lowest = packed, density
        else:
            highest = density
        if highest < 1.02 * lowest:
            break
        density = sqrt(lowest * highest) if best is not None else density / 1.5
    return best


def whole_blocks(side: float) -> int:
    """The least multiple of `BLOCK` that is not below `side`, texels."""
    return max(BLOCK, BLOCK * ceil(side / BLOCK))


def _smallest(outlines: Outlines, check: Check) -> "_Image":
    """The image of some widths that takes the fewest blocks, and of those as small the squarest."""
    n_large = int((outlines.size.max(axis=1, initial=0) > SMALL).sum())
    root, best = sqrt(float(outlines.n_blocks)), None
    for share in _WIDTHS[: len(_WIDTHS) if n_large <= _FEW else 1]:
        width = max(ceil(root * share), int(outlines.size[:, 0].max(initial=1)))
        image = _Image.filled(outlines, width, 0, check)
        assert image is not None  # as its height is free
        if best is None or image.cost < best.cost:
            best = image
    assert best is not None
    return best


@dataclass
class _Image:
    """The blocks of an image, and the charts in them.

    Attributes
    ----------
    width, height : int
        Blocks.
    place : (k, 2) int64
        Lowest column and row of each chart's box, blocks.
    flipped : (k,) bool
        Whether it is turned by half.
    """

    width: int
    height: int
    place: np.ndarray
    flipped: np.ndarray

    @property
    def cost(self) -> tuple[int, int]:
        return self.width * self.height, max(self.width, self.height)

    @staticmethod
    def filled(outlines: Outlines, width: int, height: int, check: Check) -> "_Image | None":
        """Charts in an image of a width and a height, blocks, or if that is 0 of any; None if they do not fit."""
        n = len(outlines.size)
        if n and (outlines.size[:, 0].max() > width or (height and outlines.size[:, 1].max() > height)):
            return None
        if height and outlines.n_blocks > width * height:
            return None
        image = _Image(width, height, np.zeros((n, 2), np.int64), np.zeros(n, bool))
        large = np.flatnonzero(outlines.size.max(axis=1, initial=0) > SMALL)
        top = image._drop(outlines, large, check)
        if top < 0:
            return None
        below = outlines.blocks_of(large, image.place, image.flipped, (width, height or top))
        taken = image._fill_gaps(outlines, below, bool(height), check)
        if taken is None:
            return None
        if not height:
            columns, rows = np.flatnonzero(taken.any(axis=0)), np.flatnonzero(taken.any(axis=1))
            image.width, image.height = int(columns[-1]) + 1, int(rows[-1]) + 1
        return image

    def _drop(self, outlines: Outlines, large: np.ndarray, check: Check) -> int:
        """Slide charts down, the tallest first; returns how high they reach, blocks, −1 where that is too high."""
        horizon = np.zeros(self.width, np.int64)
        size = outlines.size[large]
        order = large[np.lexsort([large, -size[:, 0], -size[:, 1]])]
        for count, k in enumerate(order.tolist()):
            if count % _SLICE == 0:
                check()
            bottom, top = outlines.profile(k)
            height, ways = int(outlines.size[k, 1]), [(bottom, top, False)]
            if outlines.turns[k] and (bottom.any() or (top != height).any()):
                ways.append((height - top[::-1], height - bottom[::-1], True))
            best = min((*_lowest(horizon, low, high), flip) for low, high, flip in ways)
            _, row, column, flip = best
            if self.height and row + height > self.height:
                return -1
            high = ways[int(flip)][1]
            horizon[column : column + len(high)] = row + high
            self.place[k], self.flipped[k] = (column, row), flip
        return int(horizon.max(initial=0))

    def _fill_gaps(self, outlines: Outlines, taken: np.ndarray, fixed: bool, check: Check) -> np.ndarray | None:
        """Put small charts into blocks that are free; returns which are taken then, None if there are too few."""
        size = outlines.size
        small = size.max(axis=1, initial=0) <= SMALL
        kinds = [(w, h) for w in range(SMALL, 0, -1) for h in range(SMALL, 0, -1)]
        for width, height in sorted(kinds, key=lambda kind: (-kind[0] * kind[1], kind)):
            check()
            chosen = np.flatnonzero(small & (size[:, 0] == width) & (size[:, 1] == height))
            if not len(chosen):
                continue
            free = _free_cells(taken, width, height)
            missing = len(chosen) - len(free)
            if missing > 0:
                if fixed:
                    return None
                more = np.zeros((ceil(missing / (taken.shape[1] // width)) * height + height, taken.shape[1]), bool)
                taken = np.concatenate([taken, more])
                free = _free_cells(taken, width, height)
            cells = free[: len(chosen)]
            self.place[chosen] = cells
            for x in range(width):
                for y in range(height):
                    taken[cells[:, 1] + y, cells[:, 0] + x] = True
        return taken


def _lowest(horizon: np.ndarray, bottom: np.ndarray, top: np.ndarray) -> tuple[int, int, int]:
    """Where a chart leaves least room below it: that and how high it would reach, weighed; its row and column."""
    windows = np.lib.stride_tricks.sliding_window_view(horizon, len(bottom))
    row = (windows - bottom).max(axis=1)
    lost = row * len(bottom) + bottom.sum() - windows.sum(axis=1)
    reach = row + int(top.max())
    cost = lost + reach * len(bottom)
    column = int(np.argmin(cost))
    return int(cost[column]), int(row[column]), column


def _free_cells(taken: np.ndarray, width: int, height: int) -> np.ndarray:
    """Columns and rows of the free cells of a grid of that size, (n, 2), the lowest rows first."""
    rows, columns = taken.shape[0] // height, taken.shape[1] // width
    grid = taken[: rows * height, : columns * width].reshape(rows, height, columns, width)
    row, column = np.nonzero(~grid.any(axis=(1, 3)))
    return np.stack([column * width, row * height], axis=1)
