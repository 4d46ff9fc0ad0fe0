"""Where rays meet what one cube map sees, by the secant method (Szirmay-Kalos et al. 2005)."""

import numpy as np
from photon_bake.addon.core.sampling.vectors import dot
from photon_bake.addon.tracing.cube_maps.cube_maps import CubeMaps
from photon_bake.addon.tracing.cube_maps.search.map_hit import MapHits
from photon_bake.tests.cube_map_methods.looks import seen_towards

CLOSE = np.float32(0.05)
"""How far from 1 the ratio of a point that counts as met may be."""

_DONE = np.float32(1e-3)
_N_STEPS = 8


def refine(
    maps: CubeMaps, which: np.ndarray, origins: np.ndarray, directions: np.ndarray, guess: np.ndarray, found: MapHits
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where rays meet what their maps see, from a guess of the distance.

    A point of the ray is before the surface if it is nearer to the map's centre than what the map sees in its
    direction, and beyond if it is farther. From a point on each side, steps are secants of the ratio of these
    distances; before there are both, a step is as long as what the ratio is short of 1.

    Parameters
    ----------
    which : (n,) int
        Map of each ray.
    origins, directions : (n, 3) float32
    guess : (n,) float32, m

    Returns
    -------
    s : (n,) float32, m
    ratio : (n,) float32
        1 where the ray meets the surface; 0 where the map sees nothing.
    texel : (n,) int64
        What was looked at last.
    """
    t, s = origins - maps.centres[which], np.maximum(guess, 0)
    ratio, texel = np.zeros(len(s), np.float32), np.zeros(len(s), np.int64)
    before, beyond = np.zeros((2, 2, len(s)), np.float32)  # s and ratio of points on either side; 0 without one
    live = np.arange(len(s))
    for _ in range(_N_STEPS):
        p = t[live] + s[live, None] * directions[live]
        texel[live], distance = seen_towards(maps, which[live], p, 0)
        ratio[live] = np.sqrt(dot(p, p)) / distance
        found.n_look_ups += len(live)
        on = (np.abs(ratio[live] - 1) > _DONE) & np.isfinite(distance)
        live, distance = live[on], distance[on]
        if len(live) == 0:
            break
        for bound, k in ((before, live[ratio[live] < 1]), (beyond, live[ratio[live] > 1])):
            bound[:, k] = s[k], ratio[k]
        step = distance * (1 - ratio[live])
        (s0, ratio0), (s1, ratio1) = before[:, live], beyond[:, live]
        both = (ratio0 > 0) & (ratio1 > 0)
        secant = s0 + (s1 - s0) * (1 - ratio0) / np.where(both, ratio1 - ratio0, 1)
        s[live] = np.maximum(np.where(both, secant, s[live] + step), 0)
    return s, ratio, texel
