"""Gather rays: what rays meet of the light in a scene's radiance cache, of one light or of several side by side."""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np

from ...core.compiling import kernel, kernel_array
from ...core.vec3 import add, put, row
from ...receivers import Receivers
from ...scene import RayKind, Scene
from ...tracing import Hits, TransparencyTracer
from ...tracing.embree import new_ray
from ..direct.direct_light import DirectLight
from ..on_bodies import OnBodies
from ..radiance_cache.radiance_cache import CacheArrays, RadianceCache
from .radiance_along import MAX_STEPS, RayLight, radiance_along


@dataclass(frozen=True)
class Incoming:
    """What n rays met.

    Attributes
    ----------
    reflected : (n, 3 l) float32, W/(m² sr)
        Radiance from surfaces, and from the world where it comes over surfaces.
    hits : Hits
        What they met first.
    """

    reflected: np.ndarray
    hits: Hits


class GatherRays:
    """Rays that gather radiance from a scene's cache.

    Parameters
    ----------
    direct : DirectLight
        For where the cache is not asked.
    beyond : GatherRays, optional
        For what lies behind the first surfaces that rays meet, where light is cut off after some bounces.

    Attributes
    ----------
    tracer : TransparencyTracer
    """

    def __init__(
        self,
        scene: Scene,
        tracer: TransparencyTracer,
        direct: DirectLight,
        cache: RadianceCache,
        beyond: "GatherRays | None" = None,
    ) -> None:
        self._scene, self.tracer = scene, tracer
        light = RayLight(cache.arrays, direct.arrays, direct.arrays_without_lamps)
        # Of each light, what is asked in which steps of a ray
        self._lights = [[(light, 0, MAX_STEPS)]]
        if beyond:
            ((behind, _, _),) = beyond._lights[0]
            self._lights = [[(light, 0, 1), (behind, 1, MAX_STEPS)]]

    @staticmethod
    def beside(rays: "Sequence[GatherRays]") -> "GatherRays":
        """The same rays for several lights that differ in all but surfaces: `Incoming` has three columns of each."""
        joined = copy(rays[0])
        joined._lights = [light for one in rays for light in one._lights]
        return joined

    @property
    def n_lights(self) -> int:
        """How many lights lie side by side."""
        return len(self._lights)

    @property
    def caches(self) -> list[CacheArrays]:
        """Of each light, what is asked where rays end first."""
        return [steps[0][0].cache for steps in self._lights]

    @property
    def light(self) -> RayLight:
        """What rays bring to where they start of the first light."""
        return self._lights[0][0][0]

    def on_bodies(self, receivers: Receivers) -> OnBodies | None:
        """Where receivers lie on bodies, None where light walks to none of them."""
        return OnBodies.of(self._scene, self.tracer.surfaces, receivers)

    def radiance_along(self, origins: np.ndarray, directions: np.ndarray, random: np.random.Generator) -> Incoming:
        """What gather rays with unit directions (n, 3) meet; see `radiance_of_paths`."""
        return self.radiance_of_paths(origins, directions, np.uint64(random.integers(1 << 63)), kind=RayKind.GATHER)

    def radiance_of_paths(
        self,
        origins: np.ndarray,
        directions: np.ndarray,
        key: np.uint64,
        first: int = 0,
        kind: np.ndarray | RayKind = RayKind.DIFFUSE,
        specular: bool = False,
    ) -> Incoming:
        """What rays meet; the mean over cosine-weighted directions is E/π.

        Parameters
        ----------
        origins, directions : (n, 3) float32
            Points off their surface and unit directions.
        key, first
            Of the random numbers (`path_key`), and the number of the first ray.
        kind : RayKind or (n,) of it
        specular : bool
            Bring also what mirrors, glass and narrow gloss show of lamps, emission and worlds.
        """
        hits = self.tracer.closest_hit(origins, directions, kind)
        left = np.ones((len(origins), 3), np.float32) if hits.tint is None else hits.tint
        kinds = np.full(len(origins), kind, np.uint8)
        at = kernel_array(origins, np.float32), kernel_array(directions, np.float32), kinds
        met = *at, hits.triangle, hits.distance, hits.u, hits.v, left
        return Incoming(self.followed(met, key, first, specular), hits)

    def followed(
        self, met: tuple[np.ndarray, ...], key: np.uint64, first: int = 0, specular: bool = False
    ) -> np.ndarray:
        """What n rays bring that are known as far as their first surfaces, (n, 3 l) float32; `radiance_of_paths`.

        Parameters
        ----------
        met
            Arrays of origins, directions, kinds, triangles, distances, u, v, and what is left of light; may be changed.
        """
        radiance = np.zeros((self.n_lights, len(met[0]), 3), np.float32)
        for steps, of_light in zip(self._lights, radiance, strict=True):
            rays = tuple(of.copy() for of in met) if len(steps) > 1 else met
            for light, first_step, last_step in steps:
                numbers = key, first, first_step, last_step
                _follow(self.tracer.arrays, new_ray(), light, *numbers, rays, specular, of_light)
        return radiance[0] if self.n_lights == 1 else np.concatenate(radiance, axis=1)


@kernel
def _follow(tracing, room, light, key, first, first_step, last_step, rays, specular, radiance):
    """Follow n rays over some steps: add what they bring to `radiance`, and unless these are all leave the rays where
    they have come to.
    """
    origin, direction, kind, triangle, distance, u, v, throughput = rays
    for k in range(len(triangle)):
        start, towards, left = row(origin, k), row(direction, k), row(throughput, k)
        ray = start, towards, np.int64(kind[k]), triangle[k], distance[k], u[k], v[k], left
        light_met, ray = radiance_along(tracing, room, light, key, first + k, first_step, last_step, ray, specular)
        add(radiance, k, light_met)
        if last_step < MAX_STEPS:
            put(origin, k, ray[0])
            put(direction, k, ray[1])
            kind[k], triangle[k], distance[k], u[k], v[k] = ray[2], ray[3], ray[4], ray[5], ray[6]
            put(throughput, k, ray[7])
