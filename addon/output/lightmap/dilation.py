"""Texels around charts."""

import numpy as np
from scipy.ndimage import distance_transform_edt


def dilated(values: np.ndarray, known: np.ndarray, padding: int = -1) -> np.ndarray:
    """Values (h, w, c) with those of the nearest known texel where they are not known; black where there is none.

    Parameters
    ----------
    known : (h, w) bool
    padding : int
        How far, in texels, values are taken; −1: over the whole image.
    """
    if known.all() or not known.any() or padding == 0:
        return np.where(known[..., None], values, np.float32(0))
    distance, (row, column) = distance_transform_edt(~known, return_indices=True)
    filled = values[row, column]
    if padding > 0:
        filled[distance > padding] = 0
    return filled
