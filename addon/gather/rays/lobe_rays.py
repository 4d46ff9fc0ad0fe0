"""Rays that points in pixels send by their glossy and glass lobes: how many, and the mean of what they find."""

from collections.abc import Callable

import numpy as np

from ...bsdf import glass_albedo, glossy_albedo, surface_at
from ...core.parallel import Workers
from ...core.sampling.vectors import dot, largest
from ...receivers import CameraPoints
from ...scene import Scene

LEAST_RAYS = 2
"""Of a point: with fewer the error could not be told."""

_CHUNK = 1 << 18  # rays
_RAY_BYTES = 1200  # a ray takes, with what it meets


def ray_counts(scene: Scene, points: CameraPoints, point: np.ndarray, n_rays: int, least: int) -> np.ndarray:
    """Rays that some points (k,) send, (k,) int64: `n_rays` if they reflect everything, others in proportion."""
    counts = np.empty(len(point), np.int64)
    for start in range(0, len(point), _CHUNK):
        part = slice(start, start + _CHUNK)
        seen = points.seen.where(point[part])
        hits = seen.hits
        surface = surface_at(scene, hits.triangle, hits.u, hits.v, hits.back(seen.direction))
        albedo = largest(glossy_albedo(surface, np.abs(dot(seen.normal, seen.direction))))
        albedo += largest(glass_albedo(surface))
        counts[part] = np.ceil(n_rays * np.minimum(albedo, 1) * largest(points.tint[point[part]]))
    return np.maximum(counts, least)


def mean_over_rays(
    counts: np.ndarray,
    find: Callable[[np.ndarray, np.random.Generator], np.ndarray],
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
        From points (n,), one of those k for each ray and in order, to what the rays find, (n, 3).
    stage, stream
        For the progress and the random numbers.
    """
    ends = np.concatenate([[0], np.cumsum(counts)])
    sums, squares = np.zeros((len(counts), 3)), np.zeros(len(counts))

    def look(chunk: slice, random: np.random.Generator) -> tuple[slice, np.ndarray, np.ndarray]:
        first, last = np.searchsorted(ends, [chunk.start, chunk.stop])
        some = slice(first, last)
        if first == last:  # the rest of a point's rays, which the chunk before has
            return some, sums[some], squares[some]
        light = find(np.repeat(np.arange(first, last), counts[some]), random)
        starts = ends[some] - ends[first]
        return some, np.add.reduceat(light, starts, axis=0), np.add.reduceat(light.mean(axis=1) ** 2, starts)

    chunks = workers.chunks(stage, int(ends[-1]), _CHUNK, look, (stream,), row_bytes=_RAY_BYTES)
    for _, (some, of_sums, of_squares) in chunks:
        sums[some], squares[some] = of_sums, of_squares
    mean = sums / counts[:, None]
    variance = np.maximum(squares / counts - mean.mean(axis=1) ** 2, 0) / (counts - 1)
    return mean.astype(np.float32), np.sqrt(variance).astype(np.float32)
