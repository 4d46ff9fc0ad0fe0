"""Rays from a camera through its pixels, followed over mirrors and glass to the surfaces that are seen in them."""

from dataclasses import dataclass

import numpy as np

from ..bsdf import SMOOTH
from ..photons.scattering import NARROW_LOBES, scatter
from ..sampling.sequences import r2_sequence
from ..sampling.vectors import dot
from ..scene import Scene
from ..tracers import Hits, LightTracer, RayKind
from ..tracers.lamp_hits import lamps_along
from .camera import Camera, SeenSurface, first_hits, surface_seen
from .pixel_filter import PixelFilter

_MOST_FOLLOWED = 8
"""Mirrors and surfaces of glass that a sample is followed over: through four bodies of glass."""

NOTHING = np.float32(1e10)
"""Depth where nothing is seen, as in Cycles."""


@dataclass(frozen=True)
class CameraSamples:
    """What s samples of each of p pixels see, sample by sample of each pixel: n = p s.

    Attributes
    ----------
    sample : (k,) int64
        The samples that came to a surface.
    seen : SeenSurface
        Where, (k,) points; their pixels are counted among those p.
    throughput : (n, 3) float32
        What mirrors and glass on the way leave of the light.
    n_followed : (n,) uint8
        How many of them there were.
    depth : (p,) float32, m
        Of the first surface that a pixel's first sample met, be it a mirror; `NOTHING` without one.
    normal : (p, 3) float32
        Mean shading normal of the first surfaces, 0 counting where there are none.
    beyond : (p, 3) float32, W/(m² sr)
        What the world, surfaces and lamps emit that is seen over more than one mirror or surface of glass.
    """

    sample: np.ndarray
    seen: SeenSurface
    throughput: np.ndarray
    n_followed: np.ndarray
    depth: np.ndarray
    normal: np.ndarray
    beyond: np.ndarray


def camera_samples(
    scene: Scene,
    tracer: LightTracer,
    camera: Camera,
    pixel_filter: PixelFilter,
    n_samples: int,
    pixel: np.ndarray,
    random: np.random.Generator,
) -> CameraSamples:
    """Trace samples through pixels (p,), and on to surfaces that scatter light widely.

    The samples of a pixel are a low-discrepancy set, shifted around the torus anew for each pixel, and distributed by
    the filter. Those that see nothing in the end, or see mirrors in mirrors for too long, come to no surface.
    """
    n = len(pixel) * n_samples
    u = r2_sequence(np.arange(n_samples)) + random.random((len(pixel), 1, 2), dtype=np.float32)
    offsets = pixel_filter.offsets(u - np.floor(u)).reshape(n, 2)
    rays = camera.rays(np.repeat(camera.middles()[pixel], n_samples, axis=0) + offsets)
    hits = first_hits(tracer, rays)
    hit = np.flatnonzero(hits.hit)
    position, normal = hits.where(hit).points(rays.origins[hit], rays.directions[hit])

    depth = np.full(n, NOTHING)
    depth[hit] = camera.depth(position)
    normals = np.zeros((n, 3), np.float32)
    normals[hit] = scene.shading_normals(hits.triangle[hit], hits.u[hit], hits.v[hit], normal)
    first_distance = np.where(hits.hit, hits.distance, np.float32(1))
    facing_area = np.zeros(n, np.float32)
    facing_area[hit] = camera.pixel_area(position)

    paths = _Paths(hits, rays.origins, rays.directions, hits.tinted(np.ones((n, 3), np.float32)), hits.distance)
    paths.follow(scene, tracer, random)
    k = np.flatnonzero(paths.hits.hit)
    grown = (paths.distance[k] / first_distance[k]) ** 2
    ends = paths.hits.where(k), paths.origins[k], paths.directions[k]
    seen = surface_seen(scene, k // n_samples, *ends, facing_area[k] * grown)
    shape = (len(pixel), n_samples)
    return CameraSamples(
        sample=k,
        seen=seen,
        throughput=paths.throughput,
        n_followed=paths.n_followed,
        depth=depth.reshape(shape)[:, 0],
        normal=normals.reshape(*shape, 3).mean(axis=1),
        beyond=(paths.lamplight + paths.emission_met(scene, 2)).reshape(*shape, 3).mean(axis=1),
    )


class _Paths:
    """n samples on their way: the last ray of each, where it ends, and the length (n,) of all the way, m.

    `lamplight` (n, 3), W/(m² sr), is of the lamps met over more than one mirror or surface of glass.
    """

    def __init__(
        self, hits: Hits, origins: np.ndarray, directions: np.ndarray, throughput: np.ndarray, distance: np.ndarray
    ) -> None:
        self.hits, self.origins, self.directions = hits, origins, directions
        self.throughput, self.distance = throughput, distance
        self.n_followed = np.zeros(len(origins), np.uint8)
        self.lamplight = np.zeros_like(throughput)

    def follow(self, scene: Scene, tracer: LightTracer, random: np.random.Generator) -> None:
        """Send those on that met a mirror or clear glass, until they meet something else; a few are dropped."""
        k = self._at_mirrors(scene, np.flatnonzero(self.hits.hit))
        if len(k) == 0:
            return
        self.hits, self.origins, self.directions = self.hits.with_tint(), self.origins.copy(), self.directions.copy()
        self.distance = self.distance.copy()
        for step in range(_MOST_FOLLOWED):
            if len(k) == 0:
                return
            hits, directions = self.hits.where(k), self.directions[k]
            positions, normals = hits.points(self.origins[k], directions)
            on = scatter(scene, hits, positions, directions, normals, random, NARROW_LOBES)
            onward = tracer.closest_hit(on.origins, on.directions, on.kind)
            self.hits.put(k, onward)
            self.origins[k], self.directions[k] = on.origins, on.directions
            self.throughput[k] *= onward.tinted(on.weight)
            if step > 0:
                kind = np.where(dot(on.directions, normals) > 0, RayKind.GLOSSY, RayKind.TRANSMITTED)
                objects = scene.object_of_triangle[hits.triangle]
                met = lamps_along(scene.lights, on.origins, on.directions, onward.distance, kind, objects)
                self.lamplight[k] += self.throughput[k] * met
            self.distance[k] += np.where(onward.hit, onward.distance, 0)
            self.n_followed[k] += 1
            k = self._at_mirrors(scene, k[onward.hit])
        self.hits.put(k, Hits.none(len(k)))
        self.throughput[k] = 0

    def _at_mirrors(self, scene: Scene, k: np.ndarray) -> np.ndarray:
        """Those of the paths k that met something that scatters light in smooth lobes alone."""
        materials = scene.materials
        material = scene.material_of_triangle[self.hits.triangle[k]]
        k = k[(materials.glossy_or_glass & ~materials.spreads_light)[material]]
        met = self.hits.where(k)
        return k[scene.look_up(materials.roughness, met.triangle, met.u, met.v)[:, 0] < SMOOTH]

    def emission_met(self, scene: Scene, least_followed: int) -> np.ndarray:
        """What is emitted where paths end that were followed so often at least, (n, 3) float32, W/(m² sr)."""
        radiance = np.zeros_like(self.throughput)
        followed = self.n_followed >= least_followed
        if not followed.any():
            return radiance
        k = np.flatnonzero(followed & self.hits.hit)
        met = self.hits.where(k)
        radiance[k] = scene.look_up(scene.materials.emission, met.triangle, met.u, met.v)
        radiance[k] *= scene.objects.emits[scene.object_of_triangle[met.triangle], None]
        k = np.flatnonzero(followed & ~self.hits.hit)
        radiance[k] = scene.world.radiance(self.directions[k])
        return radiance * self.throughput
