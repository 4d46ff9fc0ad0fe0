"""How the radiance cache is made: direct light by next-event estimation, and photons for all the rest.

A photon counts for the element it fell on, whose area is known exactly: no search radius, no boundary bias, no leaking.
What remains is noise, and the light's variation within an element, which is why elements are small where many gather
rays end. Where the noise matters, elements gather once themselves, so that receivers see photons two bounces removed.
"""

import numpy as np

from ..parallel import Workers, slices
from ..photons import Photons
from ..receivers import Receivers
from ..sampling.vectors import dot
from ..sampling.warps import sample_cosine_hemisphere, to_world
from ..scene import Scene
from ..tracers import Tracer
from .direct_light import DirectLight
from .elements import SurfaceElements
from .gather_rays import GatherRays
from .radiance_cache import RadianceCache

_PILOT, _DIRECT, _REFINE = 11, 12, 13  # streams of random numbers
_N_PILOT_RAYS = 1 << 18
_N_DIRECT_SEEN, _N_DIRECT_UNSEEN = 16, 2
_LEAST_ELEMENTS = 10_000
_CHUNK = 1 << 15


def worthwhile_elements(n_elements: int, n_rays: int, n_gather_rays: int) -> int:
    """At most `n_elements`, and as many as cost no more rays than the gather of `n_gather_rays` that they are for.

    Parameters
    ----------
    n_rays : int
        Rays that each element gathers with.
    """
    return min(n_elements, max(_LEAST_ELEMENTS, n_gather_rays // (_N_DIRECT_SEEN + n_rays)))


def build_radiance_cache(
    scene: Scene,
    tracer: Tracer,
    photons: Photons,
    direct: DirectLight,
    receivers: Receivers,
    n_elements: int,
    n_rays: int,
    workers: Workers,
) -> RadianceCache:
    """A radiance cache for gather rays from `receivers`.

    Parameters
    ----------
    photons : Photons
        With direct photons of those sources only that `direct` does not sample.
    n_elements : int
        Elements to share out by where gather rays end.
    n_rays : int
        Rays that each side seen from the receivers gathers with, from the cache of photons and direct light; 0 leaves
        the photons as they are.
    """
    visits = pilot_visits(scene, tracer, receivers, workers)
    elements = SurfaceElements.by_visits(scene, visits.sum(axis=1), n_elements)
    seen = elements.of_triangles(visits > 0).ravel()
    lit, albedo = _direct_radiance(scene, direct, elements, seen, workers)
    cache = RadianceCache.of_sides(elements, lit + photon_radiance(scene, photons, elements))
    if n_rays == 0:
        return cache
    sides = np.flatnonzero(seen)
    rays = GatherRays(scene, tracer, direct, cache)
    gathered = _gather_at_sides(scene, rays, elements, sides, n_rays, workers)
    refined = cache.radiance.copy()
    refined[sides] = lit[sides] + albedo[sides] * gathered
    return RadianceCache(elements, refined)


def pilot_visits(scene: Scene, tracer: Tracer, receivers: Receivers, workers: Workers) -> np.ndarray:
    """How often a side of a triangle ends a gather ray from a receiver, or a ray from there on: (t, 2) int64."""
    start = np.linspace(0, len(receivers), _N_PILOT_RAYS, endpoint=False).astype(np.int64)  # every receiver alike

    def fly(chunk: slice, random: np.random.Generator) -> np.ndarray:
        normals, origins = receivers.normal[start[chunk]], receivers.position[start[chunk]]
        met = []
        for _ in range(2):
            directions = to_world(sample_cosine_hemisphere(random.random((len(normals), 2), dtype=np.float32)), normals)
            hits = tracer.closest_hit(origins, directions)
            hit = np.flatnonzero(hits.hit)
            hits, directions = hits.where(hit), directions[hit]
            positions, normals = hits.points(origins[hit], directions)
            met.append(2 * hits.triangle + hits.back(directions))
            origins = positions + scene.ray_offset(positions) * normals
        return np.concatenate(met)

    visits = np.zeros(2 * scene.n_triangles, np.int64)
    for _, met in workers.chunks("Refining surfaces", _N_PILOT_RAYS, _CHUNK, fly, (_PILOT,)):
        visits += np.bincount(met, minlength=len(visits))
    return visits.reshape(-1, 2)


def photon_radiance(scene: Scene, photons: Photons, elements: SurfaceElements) -> np.ndarray:
    """Radiance that photons make of the sides they fell on, Σ ρΦ/(πA), (2 e, 3) float32."""
    radiance = np.zeros((2 * len(elements), 3), np.float64)
    for chunk in slices(len(photons), 1 << 20):
        part = photons.where(chunk)
        u, v = scene.barycentrics(part.triangle, part.position)
        back = dot(scene.normals[part.triangle], part.normal) < 0
        side = 2 * elements.find(part.triangle, u, v) + back
        reflected = scene.albedo(part.triangle, u, v) * part.power
        for channel in range(3):
            radiance[:, channel] += np.bincount(side, reflected[:, channel], minlength=len(radiance))
    area = np.repeat(elements.areas, 2)[:, None]
    return (radiance / (np.pi * area)).astype(np.float32)


def _points_on(
    scene: Scene, elements: SurfaceElements, side: np.ndarray, random: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A point on each of `side`, off the surface, with its normal and albedo, (n, 3) float32 each."""
    triangle, u, v = elements.sample(side // 2, random.random((len(side), 3), dtype=np.float32))
    normals = np.where((side % 2 == 0)[:, None], scene.normals[triangle], -scene.normals[triangle])
    positions = scene.points(triangle, u, v)
    return positions + scene.ray_offset(positions) * normals, normals, scene.albedo(triangle, u, v)


def _direct_radiance(
    scene: Scene, direct: DirectLight, elements: SurfaceElements, seen: np.ndarray, workers: Workers
) -> tuple[np.ndarray, np.ndarray]:
    """Direct light that each side reflects, mean of ρE/π over points of the element; and its mean albedo: (2 e, 3)."""
    n_samples = np.where(seen, _N_DIRECT_SEEN, _N_DIRECT_UNSEEN)

    def estimate(chunk: slice, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        counts = n_samples[chunk]
        side = np.repeat(np.arange(chunk.start, chunk.stop), counts)
        positions, normals, albedo = _points_on(scene, elements, side, random)
        reflected = albedo * direct.irradiance(positions, normals, random) / np.float32(np.pi)
        first = np.cumsum(counts) - counts
        mean_reflected, mean_albedo = (
            np.add.reduceat(values, first) / counts[:, None] for values in (reflected, albedo)
        )
        return mean_reflected, mean_albedo

    radiance, albedo = np.zeros((2, len(seen), 3), np.float32)
    for chunk, means in workers.chunks("Lighting surfaces", len(seen), 1 << 12, estimate, (_DIRECT,)):
        radiance[chunk], albedo[chunk] = means
    return radiance, albedo


def _gather_at_sides(
    scene: Scene, rays: GatherRays, elements: SurfaceElements, sides: np.ndarray, n_rays: int, workers: Workers
) -> np.ndarray:
    """Mean radiance (E/π) from the cache and the world at each of `sides`, (n, 3): a ray from a new point each time."""

    def gather(chunk: slice, random: np.random.Generator) -> np.ndarray:
        positions, normals, _ = _points_on(scene, elements, np.repeat(sides[chunk], n_rays), random)
        reflected, sky = rays.radiance(positions, normals, n_rays, random)
        return (reflected + sky).reshape(-1, n_rays, 3).mean(axis=1)

    gathered = np.zeros((len(sides), 3), np.float32)
    for chunk, mean in workers.chunks("Refining light", len(sides), max(1, _CHUNK // n_rays), gather, (_REFINE,)):
        gathered[chunk] = mean
    return gathered
