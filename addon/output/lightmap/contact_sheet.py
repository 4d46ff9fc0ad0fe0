"""All lightmaps in one small picture, to look at."""

from collections.abc import Sequence
from math import ceil, sqrt

import numpy as np

CELL, GAP = 256, 4
"""Longest side of an image on the sheet, and what lies between two, pixels."""

_BRIGHT = 98  # percentile of the light that is shown as white
_AROUND = 48  # grey between the images


def contact_sheet(images: Sequence[np.ndarray]) -> np.ndarray:
    """Images (height, width, 3 or more) side by side in sRGB, (h, w, 3) uint8 with row 0 at the top.

    All have the same exposure. Images come with row 0 at v = 0, from left to right and from the top down.
    """
    columns = max(1, ceil(sqrt(len(images))))
    rows = ceil(len(images) / columns)
    sheet = np.full((rows * (CELL + GAP) + GAP, columns * (CELL + GAP) + GAP, 3), _AROUND, np.uint8)
    lit = [image[..., :3][image[..., :3] > 0] for image in images]
    white = max((float(np.percentile(light, _BRIGHT)) for light in lit if len(light)), default=1.0)
    bottom = right = 0
    for i, image in enumerate(images):
        small = _reduced(image[::-1, :, :3])
        top, left = (GAP + place * (CELL + GAP) for place in divmod(i, columns))
        sheet[top : top + small.shape[0], left : left + small.shape[1]] = _srgb(small / white)
        bottom, right = max(bottom, top + small.shape[0]), max(right, left + small.shape[1])
    return sheet[: bottom + GAP, : right + GAP]


def _reduced(image: np.ndarray) -> np.ndarray:
    """An image whose longest side is `CELL`: averaged where it is larger, in squares where it is smaller."""
    step = ceil(max(image.shape[:2]) / CELL)
    if step > 1:
        rows, columns = (np.arange(0, n, step) for n in image.shape[:2])
        sums = np.add.reduceat(np.add.reduceat(image, rows, axis=0), columns, axis=1)
        counts = np.add.outer(np.zeros(len(rows)), np.diff(columns, append=image.shape[1]))
        counts *= np.diff(rows, append=image.shape[0])[:, None]
        return sums / counts[..., None].astype(np.float32)
    times = CELL // max(image.shape[:2])
    return np.repeat(np.repeat(image, times, axis=0), times, axis=1)


def _srgb(linear: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1, any shape, uint8."""
    x = np.clip(linear, 0, 1)
    return np.rint(255 * np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)).astype(np.uint8)
