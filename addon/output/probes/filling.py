"""Probes inside of solids take the light of their neighbours, as engines interpolate over the solids' surfaces."""

import numpy as np


def filled(values: np.ndarray, valid: np.ndarray, counts: tuple[int, int, int]) -> np.ndarray:
    """Values (n, …) of a grid's probes, those that are not `valid` (n,) as the means of valid neighbours.

    Of up to 26 neighbours; those without any take theirs afterwards, and so on. Without any valid probe all stays.
    """
    from scipy.ndimage import uniform_filter

    shape = counts[::-1]
    known = valid.reshape(shape).copy()
    light = np.where(known.ravel()[:, None], values.reshape(len(values), -1), 0).reshape(*shape, -1).astype(np.float64)
    if known.all() or not known.any():
        return values
    while not known.all():
        share = uniform_filter(known.astype(np.float64), 3, mode="constant")
        around = uniform_filter(light, (3, 3, 3, 0), mode="constant")
        new = ~known & (share > 1e-9)
        light[new] = around[new] / share[new][:, None]
        known |= new
    return light.reshape(values.shape).astype(values.dtype)
