"""Gather rays: cosine-weighted directions over hemispheres, stratified for each point, and the radiance they meet.

A ray that ends far away takes its radiance from the cache. One that ends nearer than the cache can resolve (in a
corner, under a cupboard) would read an element that is partly elsewhere; there the light is found as a path tracer
would find it: direct light at the point by next-event estimation, and a further ray for the rest (the secondary final
gather of the π-engine, section 3.2.2).
"""

from functools import lru_cache

import numpy as np

from ..sampling.streams import below_one, sobol
from ..sampling.warps import sample_cosine_hemisphere, to_world
from ..scene import Scene
from ..tracers import Hits, Tracer
from .direct_light import DirectLight
from .radiance_cache import RadianceCache

_MAX_NEAR_HITS = 4


class GatherRays:
    """Rays that gather radiance from a scene's cache.

    Parameters
    ----------
    direct : DirectLight
        For near hits.
    """

    def __init__(self, scene: Scene, tracer: Tracer, direct: DirectLight, cache: RadianceCache) -> None:
        self._scene, self._tracer, self._direct, self._cache = scene, tracer, direct, cache

    def radiance(
        self, origins: np.ndarray, normals: np.ndarray, n_rays: int, random: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Radiance that one cosine-weighted ray from each origin meets: from surfaces, and from the world.

        Every run of `n_rays` rays is stratified over the hemisphere; the mean of a run is E/π.

        Parameters
        ----------
        origins, normals : (n, 3) float32
            Points off their surface and unit normals; n is a multiple of `n_rays`.

        Returns
        -------
        reflected, sky : (n, 3) float32, W/(m² sr)
        """
        directions = to_world(sample_cosine_hemisphere(_stratified(len(origins) // n_rays, n_rays, random)), normals)
        hits = self._tracer.closest_hit(origins, directions)
        sky = np.where(hits.hit[:, None], np.float32(0), self._scene.world.radiance(directions))
        reflected, near = self._cache.look_up(hits, directions)
        k = np.flatnonzero(near)
        if len(k):
            reflected[k] = self._reflected_near(origins[k], directions[k], hits.where(k), random)
        return reflected, sky

    def _reflected_near(
        self, origins: np.ndarray, directions: np.ndarray, hits: Hits, random: np.random.Generator
    ) -> np.ndarray:
        """Radiance reflected towards `origins` by near hits, followed until they are far or there were too many."""
        scene = self._scene
        radiance = np.zeros((len(origins), 3), np.float32)
        throughput = np.ones((len(origins), 3), np.float32)
        ray = np.arange(len(origins))
        for step in range(_MAX_NEAR_HITS):
            # Direct light at the hit
            positions, normals = hits.points(origins, directions)
            positions += scene.ray_offset(positions) * normals
            throughput = throughput * scene.albedo(hits.triangle, hits.u, hits.v)
            irradiance = self._direct.irradiance(positions, normals, random, rays_follow=True)
            radiance[ray] += throughput * irradiance / np.float32(np.pi)

            # One more ray for the light that comes over other surfaces, from the world, or from what glows close by
            u = random.random((len(ray), 2), dtype=np.float32)
            origins, directions = positions, to_world(sample_cosine_hemisphere(u), normals)
            hits = self._tracer.closest_hit(origins, directions)
            radiance[ray] += np.where(hits.hit[:, None], np.float32(0), throughput * scene.world.radiance(directions))
            radiance[ray] += throughput * self._direct.emission_met(hits, directions, normals)
            reflected, near = self._cache.look_up(hits, directions)
            if step == _MAX_NEAR_HITS - 1:
                near[:] = False
            radiance[ray] += np.where(near[:, None], np.float32(0), throughput * reflected)
            k = np.flatnonzero(near)
            if len(k) == 0:
                break
            ray, throughput, origins, directions, hits = ray[k], throughput[k], origins[k], directions[k], hits.where(k)
        return radiance


def _stratified(n_runs: int, n_rays: int, random: np.random.Generator) -> np.ndarray:
    """Points of the unit square, (n_runs · n_rays, 2): one Sobol set, shifted around the torus anew for each run."""
    shifted = _sobol_set(n_rays) + random.random((n_runs, 1, 2), dtype=np.float32)
    return below_one(shifted - np.floor(shifted)).reshape(-1, 2)


@lru_cache(maxsize=16)
def _sobol_set(n: int) -> np.ndarray:
    """The first n points of the Sobol sequence, (1, n, 2) float32."""
    power_of_two = 1 << max(n - 1, 0).bit_length()
    return sobol(2, 0).random(power_of_two)[None, :n].astype(np.float32)
