"""The radiance cache: the light that every surface element reflects, on either side.

It is made of direct light by next-event estimation, and of photons for all the rest. A photon counts for the element
it fell on, whose area is known exactly: no search radius, no boundary bias, no leaking. What remains is noise, and the
light's variation within an element, which is why elements are small where many gather rays end.
"""

from dataclasses import dataclass

import numpy as np

from ..parallel import ordered_map, slices
from ..photons import Photons
from ..progress import Progress
from ..receivers import Receivers
from ..sampling.streams import stream
from ..sampling.warps import sample_cosine_hemisphere, to_world
from ..scene import Scene
from ..tracers import Hits, Tracer
from .direct_light import DirectLight
from .elements import SurfaceElements
from .hemisphere import gather_radiance

_PILOT, _DIRECT, _REFINE = 11, 12, 13  # streams of random numbers
_N_PILOT_RAYS = 1 << 18
_N_DIRECT_SEEN, _N_DIRECT_UNSEEN = 16, 2
_CHUNK = 1 << 15
_MAX_CUTS = 1024


@dataclass(frozen=True)
class RadianceCache:
    """Reflected radiance of each side of each element.

    Attributes
    ----------
    elements : SurfaceElements
    radiance : (2 e + 2, 3) float32, W/(m² sr)
        Element k's front (the side its normal is on) at 2k, its back at 2k + 1; the last two, for rays that meet
        nothing, are black. Emission is not in it.
    """

    elements: SurfaceElements
    radiance: np.ndarray

    def look_up(self, hits: Hits, directions: np.ndarray) -> np.ndarray:
        """Radiance that each ray meets, (n, 3) float32; 0 where it meets nothing."""
        back = np.einsum("ij,ij->i", hits.normal, directions) > 0
        return self.radiance[2 * self.elements.find(hits.triangle, hits.u, hits.v) + back]


def build_radiance_cache(
    scene: Scene,
    tracer: Tracer,
    photons: Photons,
    direct: DirectLight,
    receivers: Receivers,
    n_elements: int,
    n_rays: int,
    seed: int,
    n_threads: int = 0,
    progress: Progress | None = None,
) -> RadianceCache:
    """A radiance cache for gather rays from `receivers`.

    Parameters
    ----------
    photons : Photons
        With direct photons of those sources only that `direct` does not sample.
    n_elements : int
        Elements to share out by where gather rays end, beyond one a triangle.
    n_rays : int
        Rays that each side seen from the receivers gathers with, from the cache of photons and direct light, so that
        the final gather sees them one bounce removed; 0 leaves the photons as they are.
    """
    progress = progress or Progress()
    visits = pilot_visits(scene, tracer, receivers, seed, n_threads, progress)
    elements = elements_by_visits(visits.sum(axis=1), n_elements)
    seen = np.repeat(visits > 0, elements.cuts**2, axis=0).ravel()
    direct_radiance, albedo = _direct_radiance(scene, direct, elements, seen, seed, n_threads, progress)
    by_photons = direct_radiance + photon_radiance(scene, photons, elements)
    nothing = np.zeros((2, 3), np.float32)
    cache = RadianceCache(elements, np.concatenate([by_photons, nothing]))
    if n_rays == 0:
        return cache
    sides = np.flatnonzero(seen)
    gathered = _gather_at_sides(scene, tracer, cache, sides, n_rays, seed, n_threads, progress)
    refined = cache.radiance.copy()
    refined[sides] = direct_radiance[sides] + albedo[sides] * gathered
    return RadianceCache(elements, refined)


def pilot_visits(
    scene: Scene, tracer: Tracer, receivers: Receivers, seed: int, n_threads: int, progress: Progress
) -> np.ndarray:
    """How often a side of a triangle ends a gather ray from a receiver, or a ray from there on: (t, 2) int64."""
    n = _N_PILOT_RAYS
    start = np.linspace(0, len(receivers), n, endpoint=False).astype(np.int64)  # every receiver alike

    def fly(item: tuple[int, slice]) -> np.ndarray:
        index, chunk = item
        random = stream(seed, _PILOT, index)
        normals, origins = receivers.normal[start[chunk]], receivers.position[start[chunk]]
        met = []
        for _ in range(2):
            directions = to_world(sample_cosine_hemisphere(random.random((len(normals), 2), dtype=np.float32)), normals)
            hits = tracer.closest_hit(origins, directions)
            hit = np.flatnonzero(hits.hit)
            back = np.einsum("ij,ij->i", hits.normal[hit], directions[hit]) > 0
            met.append(2 * hits.triangle[hit] + back)
            positions = origins[hit] + hits.distance[hit, None] * directions[hit]
            normals = np.where(back[:, None], -hits.normal[hit], hits.normal[hit])
            origins = positions + scene.ray_offset(positions) * normals
        return np.concatenate(met)

    visits = np.zeros(2 * scene.n_triangles, np.int64)
    for met in ordered_map(fly, enumerate(slices(n, _CHUNK)), n_threads):
        visits += np.bincount(met, minlength=len(visits))
        progress.update("Refining surfaces", 0.0)
    return visits.reshape(-1, 2)


def elements_by_visits(visits: np.ndarray, n_elements: int) -> SurfaceElements:
    """Elements that share out `n_elements` in proportion to each triangle's visits, at least one a triangle."""
    wanted = visits * (n_elements / max(visits.sum(), 1))
    return SurfaceElements.of_cuts(np.clip(np.rint(np.sqrt(wanted)), 1, _MAX_CUTS))


def photon_radiance(scene: Scene, photons: Photons, elements: SurfaceElements) -> np.ndarray:
    """Radiance that photons make of the sides they fell on, Σ ρΦ/(πA), (2 e, 3) float32."""
    radiance = np.zeros((2 * len(elements), 3), np.float64)
    for chunk in slices(len(photons), 1 << 20):
        part = photons.where(chunk)
        u, v = scene.barycentrics(part.triangle, part.position)
        back = np.einsum("ij,ij->i", scene.normals[part.triangle], part.normal) < 0
        side = 2 * elements.find(part.triangle, u, v) + back
        reflected = scene.albedo(part.triangle, u, v) * part.power
        for channel in range(3):
            radiance[:, channel] += np.bincount(side, reflected[:, channel], minlength=len(radiance))
    area = np.repeat(elements.areas(scene), 2)[:, None]
    return (radiance / (np.pi * area)).astype(np.float32)


def _direct_radiance(
    scene: Scene,
    direct: DirectLight,
    elements: SurfaceElements,
    seen: np.ndarray,
    seed: int,
    n_threads: int,
    progress: Progress,
) -> tuple[np.ndarray, np.ndarray]:
    """Direct light that each side reflects, mean of ρE/π over points of the element; and its mean albedo: (2 e, 3)."""
    n_samples = np.where(seen, _N_DIRECT_SEEN, _N_DIRECT_UNSEEN)
    ends = np.cumsum(n_samples)

    def estimate(item: tuple[int, slice]) -> tuple[slice, np.ndarray, np.ndarray]:
        index, chunk = item
        random = stream(seed, _DIRECT, index)
        counts = n_samples[chunk]
        side = np.repeat(np.arange(chunk.start, chunk.stop), counts)
        u = random.random((len(side), 2), dtype=np.float32)
        triangle, b1, b2 = elements.sample(side // 2, u[:, 0], u[:, 1])
        normals = np.where((side % 2 == 0)[:, None], scene.normals[triangle], -scene.normals[triangle])
        positions = scene.points(triangle, b1, b2)
        positions += scene.ray_offset(positions) * normals
        albedo = scene.albedo(triangle, b1, b2)
        reflected = albedo * direct.irradiance(positions, normals, random) / np.float32(np.pi)
        first = np.concatenate([[0], np.cumsum(counts)[:-1]])
        return (
            chunk,
            np.add.reduceat(reflected, first) / counts[:, None],
            np.add.reduceat(albedo, first) / counts[:, None],
        )

    radiance, albedo = np.zeros((2, len(n_samples), 3), np.float32)
    for chunk, of_chunk, albedo_of_chunk in ordered_map(estimate, enumerate(slices(len(ends), 1 << 12)), n_threads):
        radiance[chunk], albedo[chunk] = of_chunk, albedo_of_chunk
        progress.update("Lighting surfaces", chunk.stop / len(ends))
    return radiance, albedo


def _gather_at_sides(
    scene: Scene,
    tracer: Tracer,
    cache: RadianceCache,
    sides: np.ndarray,
    n_rays: int,
    seed: int,
    n_threads: int,
    progress: Progress,
) -> np.ndarray:
    """Mean radiance (E/π) from the cache and the world at each of `sides`, (n, 3): a ray from a new point each time."""
    side_rays = max(1, _CHUNK // n_rays)

    def gather(item: tuple[int, slice]) -> tuple[slice, np.ndarray]:
        index, chunk = item
        random = stream(seed, _REFINE, index)
        side = np.repeat(sides[chunk], n_rays)
        u = random.random((len(side), 2), dtype=np.float32)
        triangle, b1, b2 = cache.elements.sample(side // 2, u[:, 0], u[:, 1])
        normals = np.where((side % 2 == 0)[:, None], scene.normals[triangle], -scene.normals[triangle])
        positions = scene.points(triangle, b1, b2)
        positions += scene.ray_offset(positions) * normals
        reflected, sky = gather_radiance(scene, tracer, cache.look_up, positions, normals, n_rays, random)
        return chunk, (reflected + sky).reshape(-1, n_rays, 3).mean(axis=1)

    gathered = np.zeros((len(sides), 3), np.float32)
    for chunk, mean in ordered_map(gather, enumerate(slices(len(sides), side_rays)), n_threads):
        gathered[chunk] = mean
        progress.update("Refining light", chunk.stop / len(sides))
    return gathered
