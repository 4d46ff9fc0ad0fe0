"""What a camera sees in gloss, by rays into the radiance cache; direct light on diffuse surfaces seen in mirrors."""

import numpy as np

from ...bsdf.mixture import NARROW_LOBES
from ...bsdf.scatter import scatter
from ...core.compiling import kernel
from ...core.parallel import Workers
from ...core.sampling.path_numbers import path_key, two_numbers
from ...core.vec3 import BLACK, ZERO, put, row
from ...receivers import CameraPoints
from ...scene import RayKind, Scene
from ...scene.hit import hit_at
from ..direct.direct_light import DirectLight
from .gather_rays import GatherRays
from .lobe_rays import LEAST_RAYS, mean_over_rays, ray_counts

N_DIRECT = 8
"""Estimates of direct light at a point that is seen in a mirror."""

_CAMERA = int(RayKind.CAMERA)
_CHUNK = 1 << 16  # estimates
_GLOSS, _DIRECT = 74, 75  # streams of random numbers
_LEAVING = 1 << 15  # of a path's pairs of numbers, the first for the lobe that it leaves by


def camera_gloss(
    scene: Scene, points: CameraPoints, rays: GatherRays | None, n_rays: int, workers: Workers
) -> tuple[np.ndarray, np.ndarray]:
    """Radiance (n, 3) that the points' glossy and glass lobes send to the camera, as pixels get it, and its error (n,).

    Lamps and the world that lobes reflect straight to the camera are direct light and not in it, nor are the
    `reflected_highlights` of what is seen in mirrors.

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
    point = np.flatnonzero(scene.materials.narrow[scene.material_of_triangle[points.seen.hits.triangle]])
    if rays is None or len(point) == 0:
        return radiance, stderr
    counts, seen = ray_counts(scene, points, point, n_rays, LEAST_RAYS), points.seen
    surfaces = seen.hits.triangle, seen.hits.u, seen.hits.v, seen.direction

    def gather(of_ray: np.ndarray, key: np.uint64, first: int) -> np.ndarray:
        origins, directions, weight = np.empty((3, len(of_ray), 3), np.float32)
        k, kind = point[of_ray], np.empty(len(of_ray), np.uint8)
        _leave(scene.arrays, *surfaces, k, key, first, origins, directions, kind, weight)
        met = rays.radiance_of_paths(origins, directions, key, first, kind, specular=True)
        return points.tint[k] * weight * met.reflected

    radiance[point], stderr[point] = mean_over_rays(counts, gather, "Following gloss", _GLOSS, workers)
    return radiance, stderr


@kernel
def _leave(scene, triangle, u, v, direction, point, key, first, origins, directions, kinds, weights):
    """Send rays on by the glossy and glass lobes of those surfaces `point` (n,) that directions came to."""
    for ray in range(len(point)):
        k, path = point[ray], first + ray
        hit = hit_at(scene, row(direction, k), triangle[k], ZERO, u[k], v[k])
        choice, _ = two_numbers(key, path, _LEAVING)
        a, b = two_numbers(key, path, _LEAVING + 1)
        on = scatter(scene, hit, row(direction, k), choice, a, b, NARROW_LOBES, False, _CAMERA)
        put(origins, ray, on.origin)
        put(directions, ray, on.direction)
        put(weights, ray, on.weight if on.alive else BLACK)
        kinds[ray] = on.kind


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
    lit = np.flatnonzero(at.takes_caustics & colour.any(axis=1)) if at.takes_caustics is not None else np.zeros(0, int)
    radiance, key = np.zeros_like(colour), path_key(workers.seed, _DIRECT)

    def light(chunk: slice, _: np.random.Generator) -> np.ndarray:
        k = lit[chunk]
        return direct.mean_irradiance(at.position[k], at.normal[k], objects[k], N_DIRECT, key, chunk.start)

    chunks = workers.chunks("Lighting mirrors", len(lit), _CHUNK // N_DIRECT, light, (_DIRECT,)) if len(lit) else ()
    for chunk, irradiance in chunks:
        k = lit[chunk]
        radiance[k] = colour[k] * irradiance / np.float32(np.pi)
    return radiance
