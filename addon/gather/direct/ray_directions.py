"""Directions around normals, stratified for each point, by the density that suits what is asked of them."""

from functools import lru_cache

import numpy as np

from ...core.compiling import kernel, part
from ...core.sampling.sobol import fixed_points
from ...core.sampling.warps import cosine_hemisphere
from ...core.vec3 import put, row, to_world

_BELOW_ONE = np.float32(1 - 2**-24)


def gather_directions(normals: np.ndarray, n_rays: int, random: np.random.Generator) -> np.ndarray:
    """Cosine-weighted directions around normals (n, 3), (n, 3) float32; every run of `n_rays` is stratified."""
    directions, shifts = np.empty_like(normals), random.random((len(normals) // n_rays, 2), dtype=np.float32)
    _directions(normals, stratified_set(n_rays), shifts, directions)
    return directions


@lru_cache(maxsize=16)
def stratified_set(n: int) -> np.ndarray:
    """The first n points of the Sobol sequence, (n, 2) float32, for `shifted`."""
    return fixed_points(n)


@part
def shifted(points, k, a, b):
    """The k-th of a set of points of the unit square, all of it shifted around the torus by a, b in [0, 1)."""
    u, v = points[k, 0] + a, points[k, 1] + b
    return min(u - np.floor(u), _BELOW_ONE), min(v - np.floor(v), _BELOW_ONE)


@kernel
def _directions(normals, points, shifts, directions):
    """Cosine-weighted directions around n normals; runs of as many as there are points share a shift, (runs, 2)."""
    n = len(points)
    for k in range(len(normals)):
        u, v = shifted(points, k % n, shifts[k // n, 0], shifts[k // n, 1])
        put(directions, k, to_world(cosine_hemisphere(u, v), row(normals, k)))
