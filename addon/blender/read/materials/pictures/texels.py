"""What a texture node shows of an image, averaged over texels.

Cycles interpolates between the values that an image holds, bytes with sRGB's curve among them, and takes the curve away
afterwards. The curve is convex, so a surface is darker between two texels than the mean of both: a gradient from black
to white has the mean ∫ f(t) dt = 0.31, f being the curve, and not ½. Light that comes back from a picture is the mean
over many of its texels, so each takes the mean of what is shown within it.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from .....core.parallel import ordered_map

MAX_SIDE = 1024
"""Longest side of a picture in texels; longer ones are reduced by box averaging, which bounds memory to 16 MiB each."""

SMALL_SIDE = 128
"""Along sides that are shorter, pictures get more texels; in others they hardly show."""

EXACT_SIDE = 256
"""Longest side of pictures whose texels each get the mean within them; in others neighbours make up for each other."""

CHUNK = 1 << 16
"""Texels that are worked on together."""

_GAUSS = 1 / 12**0.5
"""Gauss' two points in an interval lie so far from its middle, over its length; they are exact for cubic curves."""

_Taps = list[tuple[np.ndarray, np.ndarray]]
"""Texels and their weights, (n,) each, whose sum is interpolated at n places along an axis."""


@dataclass(frozen=True)
class StoredImage:
    """An image as Cycles interpolates between its texels.

    Attributes
    ----------
    pixels : (h, w, 4) float32
        Rows from the bottom; colours and alpha, both from 0 if `encoded`.
    encoded : bool
        Whether the colours have sRGB's curve.
    associated : bool
        Whether alpha is multiplied into the colours, and is divided out again after interpolation.
    """

    pixels: np.ndarray
    encoded: bool
    associated: bool

    def shown(self, interpolation: str, extension: str) -> np.ndarray:
        """Mean of what a node shows within each texel, (h, w, 4) float32, scene-linear colour and alpha.

        Parameters
        ----------
        interpolation : str
            The node's: Linear, Closest, Cubic or Smart.
        extension : str
            The node's: REPEAT, EXTEND, CLIP or MIRROR.
        """
        if not (self.encoded or self.associated) and max(self.pixels.shape) > EXACT_SIDE:
            interpolation = "Closest"  # which has the same mean
        down, across = (_looks(n, interpolation, extension) for n in self.pixels.shape[:2])
        rows, columns = (_reduction(len(looks[0][0][0])) for looks in (down, across))
        planes = np.ascontiguousarray(self.pixels.transpose(2, 0, 1))
        if not self.associated and (planes[3] == 1).all() and extension != "CLIP":
            planes = planes[:3]
        step = max(CHUNK * (len(rows) - 1) // (columns[-1] * rows[-1]), 1)

        def work(first: int) -> np.ndarray:
            """Some rows of the result."""
            edges = rows[first : first + step + 1]
            total = np.zeros((len(planes), edges[-1] - edges[0], columns[-1]), np.float32)
            for of_row in down:
                chosen = [(texel[edges[0] : edges[-1]], weight[edges[0] : edges[-1], None]) for texel, weight in of_row]
                lines = _sum(chosen, planes, 1)
                for of_column in across:
                    total += self._linear(_sum(of_column, lines, 2))
            total = _reduced(_reduced(total, edges - edges[0], 1), columns, 2)
            return total / np.float32(len(down) * len(across))

        shown = np.concatenate(list(ordered_map(work, range(0, len(rows) - 1, step))), axis=1)
        result = np.ones((*shown.shape[1:], 4), np.float32)
        result[..., : len(shown)] = shown.transpose(1, 2, 0)
        return result

    def _linear(self, planes: np.ndarray) -> np.ndarray:
        """Interpolated planes (3 or 4, h, w) without what they are stored with; changes them."""
        color = planes[:3]
        if self.associated:
            color /= np.where(planes[3] > 0, planes[3], 1)
        if self.encoded:
            color[:] = srgb_to_linear(color)
        return planes


def _looks(n: int, interpolation: str, extension: str) -> list[_Taps]:
    """For each point at which a picture is looked at in every texel of the result, along an axis of n texels."""
    if interpolation == "Closest":
        return [[(np.arange(n), np.ones(n, np.float32))]]
    repeats = max(SMALL_SIDE // n // 2 * 2, 1)
    if repeats > 1:  # texels that end where curves between texels do
        points = [0.5 - _GAUSS, 0.5 + _GAUSS]
    elif n <= EXACT_SIDE:
        points = [0.25 - _GAUSS / 2, 0.25 + _GAUSS / 2, 0.75 - _GAUSS / 2, 0.75 + _GAUSS / 2]
    else:  # Gauss' points between the middles of neighbours, one in each
        points = [_GAUSS, 1 - _GAUSS]
    return [
        _interpolation((np.arange(n * repeats) + point) / repeats - 0.5, n, interpolation != "Linear", extension)
        for point in points
    ]


def _interpolation(at: np.ndarray, n: int, cubic: bool, extension: str) -> _Taps:
    """Uniform cubic B-splines, which Smart means too, or the straight line between two of n texels, at places (m,)."""
    first, t = np.floor(at).astype(int), at - np.floor(at)
    splines = ((1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, 1 + 3 * t + 3 * t**2 - 3 * t**3, t**3)
    weights = [one / 6 for one in splines] if cubic else [1 - t, t]
    taps = []
    for texel, weight in zip(range(-1 if cubic else 0, 3), weights, strict=False):
        index, inside = extended(first + texel, n, extension)
        taps.append((index, (weight * inside).astype(np.float32)))
    return taps


def extended(texel: np.ndarray, n: int, extension: str) -> tuple[np.ndarray, np.ndarray]:
    """Texels that stand for those outside of n, and whether they count."""
    inside = ((texel >= 0) & (texel < n)) | (extension != "CLIP")
    if extension == "REPEAT":
        return texel % n, inside
    if extension == "MIRROR":
        return np.minimum(texel % (2 * n), 2 * n - 1 - texel % (2 * n)), inside
    return np.clip(texel, 0, n - 1), inside


def _sum(taps: _Taps, planes: np.ndarray, axis: int) -> np.ndarray:
    """The weighted sum of texels of planes (c, h, w) along an axis."""
    if len(taps) == 1:
        return planes.take(taps[0][0], axis)
    terms = (planes.take(texel, axis, mode="clip") * weight for texel, weight in taps)
    total = next(terms)
    for term in terms:
        total += term
    return total


def _reduction(n: int) -> np.ndarray:
    """Where the texels of a picture of at most `MAX_SIDE` start among n, and the end."""
    m = min(n, MAX_SIDE)
    return np.arange(m + 1) * n // m


def _reduced(pixels: np.ndarray, edges: np.ndarray, axis: int) -> np.ndarray:
    """Means between edges along an axis."""
    if len(edges) == pixels.shape[axis] + 1:
        return pixels
    shape = [1, 1, 1]
    shape[axis] = -1
    return np.add.reduceat(pixels, edges[:-1], axis=axis) / np.diff(edges).astype(np.float32).reshape(shape)


def srgb_to_linear(encoded: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1, any shape, float32; by a table from 0 to 1."""
    if encoded.min(initial=0) < 0 or encoded.max(initial=0) > 1:
        return _curve(encoded)
    return _table().take((encoded * np.float32(_N_TABLE - 1) + np.float32(0.5)).astype(np.int32), mode="clip")


def linear_to_srgb(linear: np.ndarray) -> np.ndarray:
    """The inverse, any shape, float32."""
    linear = np.maximum(linear, 0)
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055).astype(np.float32)


def _curve(encoded: np.ndarray) -> np.ndarray:
    bright = ((np.maximum(encoded, 0) + 0.055) / 1.055) ** 2.4
    return np.where(encoded <= 0.04045, encoded / 12.92, bright).astype(np.float32)


_N_TABLE = 1 << 16


@cache
def _table() -> np.ndarray:
    return _curve(np.linspace(0, 1, _N_TABLE))
