"""Rays that points in pixels send by their glossy and glass lobes: how many, and the mean of what they find."""

from collections.abc import Callable

import numpy as np

from ...bsdf.albedos import glass_albedo, glossy_albedo
from ...bsdf.closure import bsdf_at
from ...bsdf.scatter import axis_at
from ...core.compiling import kernel
from ...core.parallel import Workers, slices
from ...core.sampling.path_numbers import path_key
from ...core.vec3 import ONE, ZERO, largest, negative, row, to_local
from ...receivers import CameraPoints
from ...scene import RayKind, Scene
from ...scene.hit import hit_at

LEAST_RAYS = 2
"""Of a point: with fewer the error could not be told."""

_CAMERA = int(RayKind.CAMERA)
_CHUNK = 1 << 15  # rays
_COUNTED = 1 << 17  # points
_RAY_BYTES = 150  # a ray takes, with what it meets


def ray_counts(scene: Scene, points: CameraPoints, point: np.ndarray, n_rays: int, least: int) -> np.ndarray:
    """Rays that some points (k,) send, (k,) int64: `n_rays` if they reflect everything, others in proportion."""
    counts, seen = np.empty(len(point), np.int64), points.seen
    for chunk in slices(len(point), _COUNTED):
        surface = seen.hits.triangle, seen.hits.u, seen.hits.v, seen.direction, points.tint
        _count(scene.arrays, *surface, point[chunk], n_rays, least, counts[chunk])
    return counts


@kernel
def _count(scene, triangle, u, v, direction, tint, point, n_rays, least, counts):
    """`ray_counts` of points."""
    for i in range(len(point)):
        k = point[i]
        flown = row(direction, k)
        hit = hit_at(scene, flown, triangle[k], ZERO, u[k], v[k])
        bsdf, wo = bsdf_at(scene, hit, _CAMERA), to_local(negative(flown), axis_at(scene, hit, flown))
        albedo = largest(glossy_albedo(scene, bsdf, wo)) + largest(glass_albedo(scene, bsdf))
        counts[i] = max(np.int64(np.ceil(np.float32(n_rays) * min(albedo, ONE) * largest(row(tint, k)))), least)


def mean_over_rays(
    counts: np.ndarray,
    find: Callable[[np.ndarray, np.uint64, int], np.ndarray],
    stage: str,
    stream: int,
    workers: Workers,
) -> tuple[np.ndarray, np.ndarray]:
    """What k points find by some rays each, (k, 3) float32, and the standard error of its mean over colours, (k,).

    Parameters
    ----------
    counts : (k,) int64
        Rays of each, at least two.
    find : callable
        From points (n,), one of those k for each ray and in order, and the key of their random numbers and the number
        of the first ray, to what the rays find, (n, 3).
    stage, stream
        For the progress and the random numbers.
    """
    ends, key = np.concatenate([[0], np.cumsum(counts)]), path_key(workers.seed, stream)
    sums, squares = np.zeros((len(counts), 3)), np.zeros(len(counts))

    def look(chunk: slice, _: np.random.Generator) -> None:
        first, last = np.searchsorted(ends, [chunk.start, chunk.stop])
        if first == last:  # the rest of a point's rays, which the chunk before has
            return
        some, starts = slice(first, last), ends[first:last] - ends[first]
        light = find(np.repeat(np.arange(first, last), counts[some]), key, int(ends[first]))
        sums[some] = np.add.reduceat(light, starts, axis=0, dtype=np.float64)
        squares[some] = np.add.reduceat(light.mean(axis=1, dtype=np.float64) ** 2, starts)

    for _ in workers.chunks(stage, int(ends[-1]), _CHUNK, look, (stream,), row_bytes=_RAY_BYTES):
        pass
    mean = sums / counts[:, None]
    variance = np.maximum(squares / counts - mean.mean(axis=1) ** 2, 0) / (counts - 1)
    return mean.astype(np.float32), np.sqrt(variance).astype(np.float32)
