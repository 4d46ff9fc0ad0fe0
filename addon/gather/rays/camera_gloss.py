"""What a camera sees in gloss, by rays into the radiance cache; direct light on diffuse surfaces seen in mirrors."""

import numpy as np

from ...core.parallel import Workers
from ...photons.scattering import NARROW_LOBES, scatter
from ...receivers import CameraPoints
from ...scene import Scene
from ..direct.direct_light import DirectLight
from .gather_rays import GatherRays
from .lobe_rays import LEAST_RAYS, mean_over_rays, ray_counts

N_DIRECT = 8
"""Estimates of direct light at a point that is seen in a mirror."""

_CHUNK = 1 << 16  # estimates
_GLOSS, _DIRECT = 74, 75  # streams of random numbers


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
    point = np.flatnonzero(scene.materials.glossy_or_glass[scene.material_of_triangle[points.seen.hits.triangle]])
    if rays is None or len(point) == 0:
        return radiance, stderr
    counts = ray_counts(scene, points, point, n_rays, LEAST_RAYS)

    def gather(of_ray: np.ndarray, random: np.random.Generator) -> np.ndarray:
        k = point[of_ray]
        seen = points.seen.where(k)
        on = scatter(scene, seen.hits, seen.position, seen.direction, seen.normal, random, NARROW_LOBES)
        met = rays.radiance_along(on.origins, on.directions, random, focused=True)
        return points.tint[k] * on.weight * met.reflected

    radiance[point], stderr[point] = mean_over_rays(counts, gather, "Following gloss", _GLOSS, workers)
    return radiance, stderr


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
