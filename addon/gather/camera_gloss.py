"""What a camera sees in gloss, by rays into the radiance cache, and the direct light on what it sees in mirrors."""

import numpy as np

from ..bsdf import glossy_albedo, surface_at
from ..parallel import Workers
from ..photons.scattering import NARROW_LOBES, scatter
from ..receivers import CameraPoints
from ..sampling.vectors import dot, largest
from ..scene import Scene
from .direct_light import DirectLight
from .gather_rays import GatherRays

N_DIRECT = 8
"""Estimates of direct light at a point that is seen in a mirror."""

_LEAST_RAYS = 2  # of a point: with fewer the error could not be told
_CHUNK = 1 << 16  # rays
_GLOSS, _DIRECT = 74, 75  # streams of random numbers


def camera_gloss(
    scene: Scene, points: CameraPoints, rays: GatherRays | None, n_rays: int, workers: Workers
) -> tuple[np.ndarray, np.ndarray]:
    """Radiance (n, 3) that the points' glossy and glass lobes send to the camera, as pixels get it, and its error (n,).

    Lamps and the world that lobes reflect straight to the camera are direct light and not in it; on what is seen in
    mirrors they are, but for lamps.

    Parameters
    ----------
    n_rays : int
        Of a point that reflects everything; others have fewer in proportion, as they make less noise.

    Returns
    -------
    radiance : (n, 3) float32, W/(m² sr)
    stderr : (n,) float32, W/(m² sr)
        Of its mean over colours.
    """
    radiance, stderr = np.zeros((len(points), 3), np.float32), np.zeros(len(points), np.float32)
    point = np.flatnonzero(scene.materials.glossy_or_glass[scene.material_of_triangle[points.seen.hits.triangle]])
    if rays is None or len(point) == 0:
        return radiance, stderr
    counts = _ray_counts(scene, points, point, n_rays)
    ends = np.concatenate([[0], np.cumsum(counts)])

    def gather(chunk: slice, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        first, last = np.searchsorted(ends, [chunk.start, chunk.stop])
        k = np.repeat(point[first:last], counts[first:last])
        seen, followed = points.seen.where(k), (points.n_followed[k] > 0)[:, None]
        on = scatter(scene, seen.hits, seen.position, seen.direction, seen.normal, random, NARROW_LOBES)
        met = rays.radiance_along(on.origins, on.directions, random)
        light = points.tint[k] * on.weight * (met.reflected + np.where(followed, met.sky, 0))
        starts = ends[first:last] - ends[first]
        return np.add.reduceat(light, starts, axis=0), np.add.reduceat(light.mean(axis=1) ** 2, starts)

    sums, squares = np.zeros((len(point), 3)), np.zeros(len(point))
    for chunk, (of_sums, of_squares) in workers.chunks("Following gloss", int(ends[-1]), _CHUNK, gather, (_GLOSS,)):
        first, last = np.searchsorted(ends, [chunk.start, chunk.stop])
        sums[first:last], squares[first:last] = of_sums, of_squares
    mean = sums / counts[:, None]
    radiance[point] = mean
    variance = np.maximum(squares / counts - mean.mean(axis=1) ** 2, 0) / (counts - 1)
    stderr[point] = np.sqrt(variance)
    return radiance, stderr


def _ray_counts(scene: Scene, points: CameraPoints, point: np.ndarray, n_rays: int) -> np.ndarray:
    """Rays that points send, (k,) int64, by the albedo of their narrow lobes."""
    counts = np.empty(len(point), np.int64)
    for start in range(0, len(point), _CHUNK):
        part = slice(start, start + _CHUNK)
        seen = points.seen.where(point[part])
        hits = seen.hits
        surface = surface_at(scene, hits.triangle, hits.u, hits.v, hits.back(seen.direction))
        albedo = largest(glossy_albedo(surface, np.abs(dot(seen.normal, seen.direction))))
        albedo += largest(np.maximum(surface.glass_reflection, surface.glass_transmission))
        counts[part] = np.ceil(n_rays * np.minimum(albedo, 1) * largest(points.tint[point[part]]))
    return np.maximum(counts, _LEAST_RAYS)


def reflected_direct(scene: Scene, points: CameraPoints, direct: DirectLight, workers: Workers) -> np.ndarray:
    """Radiance by direct light on diffuse surfaces that are seen in mirrors or through glass, as pixels get it.

    Returns
    -------
    (r, 3) float32, W/(m² sr)
        For each of the points' receivers; 0 for what the camera itself sees.
    """
    at = points.receivers(scene)
    colour = np.concatenate([points.front, points.back[points.through]])
    objects = scene.object_of_triangle[points.seen.hits.triangle]
    objects = np.concatenate([objects, objects[points.through]])
    row = np.flatnonzero(at.takes_caustics & colour.any(axis=1)) if at.takes_caustics is not None else np.zeros(0, int)
    radiance = np.zeros_like(colour)

    def light(chunk: slice, random: np.random.Generator) -> np.ndarray:
        k = np.repeat(row[chunk], N_DIRECT)
        irradiance = direct.irradiance_with_sky(at.position[k], at.normal[k], objects[k], random)
        return irradiance.reshape(-1, N_DIRECT, 3).mean(axis=1)

    chunks = workers.chunks("Lighting mirrors", len(row), _CHUNK // N_DIRECT, light, (_DIRECT,)) if len(row) else ()
    for chunk, irradiance in chunks:
        k = row[chunk]
        radiance[k] = colour[k] * irradiance / np.float32(np.pi)
    return radiance
