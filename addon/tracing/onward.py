"""What rays meet beyond a surface that they passed: each surface once, however flat they pass it.

A hit is known to a few units in the last place, across its surface; along a ray that is as much over the sine of the
angle between them. A ray that starts again just beyond a hit may thus meet the same surface again. It does so on the
same side of a surface that is parallel, and no farther from the plane passed than rounding reaches: that is how such
hits are told from others. Longer steps would miss walls that stand on the surface.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..core.sampling.vectors import dot, rows
from ..scene import Scene
from .protocol import Hits

_STEP = np.float32(1 / 8)
"""How far beyond a hit rays start again, over `Scene.ray_offset`, which leaves a wide margin; twice as far each time
that they meet the same surface."""

_PARALLEL = np.float32(1 - 1e-5)
_MAX_AGAIN = 16

ClosestHit = Callable[[np.ndarray, np.ndarray, np.ndarray], Hits]
"""The first hits of rays, by origins (n, 3), directions (n, 3) and farthest distances (n,)."""


def onward(
    scene: Scene,
    closest_hit: ClosestHit,
    directions: np.ndarray,
    passed: Hits,
    t_max: np.ndarray | float = np.inf,
    first: np.ndarray | None = None,
) -> Hits:
    """The first hit of each ray beyond the one that it passed, with its distance from the ray's origin.

    Parameters
    ----------
    first : (n,) int32, optional
        Triangles that were passed, too, in the same place: their sides may be the other way round.
    """
    start, _ = passed.points(scene, directions)
    gap = scene.ray_offset(passed.triangle, start)[:, 0]
    left = t_max - passed.distance

    def beyond(k: np.ndarray | slice, far_on: np.ndarray) -> Hits:
        flown = directions[k]
        found = closest_hit(start[k] + far_on[:, None] * flown, flown, np.maximum(left[k] - far_on, 0))
        return replace(found, distance=found.distance + far_on)

    # Distances are counted from the surface passed until the end
    hits = beyond(slice(None), _STEP * gap)
    first = passed.triangle if first is None else first
    k = np.flatnonzero(_meet_it_again(hits, passed, first, directions, gap))
    for turn in range(_MAX_AGAIN):
        if len(k) == 0:
            break
        found = beyond(k, hits.distance[k] + (2**turn) * _STEP * gap[k])
        hits.put(k, found)
        k = k[_meet_it_again(found, passed.where(k), first[k], directions[k], gap[k])]
    return replace(hits, distance=hits.distance + passed.distance)


def _meet_it_again(hits: Hits, passed: Hits, first: np.ndarray, directions: np.ndarray, gap: np.ndarray) -> np.ndarray:
    """Whether rays met the surface that they had passed and fly on from, (n,) bool."""
    again = hits.hit & ((dot(hits.normal, passed.normal) > _PARALLEL) | (hits.triangle == first))
    k = np.flatnonzero(again)
    across = np.abs(dot(rows(passed.normal, k), rows(directions, k)))
    again[k] = hits.distance[k] * across <= gap[k]
    return again
