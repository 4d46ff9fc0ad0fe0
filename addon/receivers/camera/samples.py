"""Rays from a camera through its pixels, and the surfaces that they come to."""

from dataclasses import dataclass

import numpy as np

from ...bsdf import lambertian_normals
from ...core.sampling.sequences import r2_sequence
from ...core.sampling.vectors import rows
from ...scene import Scene
from ...tracing import Hits, TransparencyTracer
from .camera import Camera, CameraRays, SeenSurface, first_hits, surface_seen
from .paths import followed_paths
from .pixel_filter import PixelFilter

NOTHING = np.float32(1e10)
"""Depth where nothing is seen, as in Cycles."""


@dataclass(frozen=True)
class CameraSamples:
    """What s samples of each of p pixels see, sample by sample of each pixel; of what glass splits, each part.

    Attributes
    ----------
    seen : SeenSurface
        Where samples came to a surface, (k,) points; their pixels are counted among those p.
    share : (k,) float32
        Of their sample: 1 for what was not split.
    throughput : (k, 3) float32
        What mirrors, glass and media on the way leave of the light.
    n_followed : (k,) uint8
        How many of them there were.
    depth : (p,) float32, m
        Of the first surface that a pixel's first sample met, be it a mirror; `NOTHING` without one.
    normal : (p, 3) float32
        Mean shading normal of the first surfaces, 0 counting where there are none.
    beyond : (p, 3) float32, W/(m² sr)
        What the world, surfaces and lamps emit that is seen over more than one mirror or surface of glass.
    transmittance : (p, 3) float32 or None
        What media leave of light between the camera and the first surfaces; None in a scene without media.
    """

    seen: SeenSurface
    share: np.ndarray
    throughput: np.ndarray
    n_followed: np.ndarray
    depth: np.ndarray
    normal: np.ndarray
    beyond: np.ndarray
    transmittance: np.ndarray | None


def camera_samples(
    scene: Scene,
    tracer: TransparencyTracer,
    camera: Camera,
    pixel_filter: PixelFilter,
    n_samples: int,
    pixel: np.ndarray,
    random: np.random.Generator,
) -> CameraSamples:
    """Trace samples through pixels (p,), and on to surfaces that scatter light widely.

    The samples of a pixel are a low-discrepancy set, shifted around the torus anew for each pixel, and distributed by
    the filter. Those that see nothing in the end or a holdout at first, or see mirrors in mirrors for too long, come to
    no surface.
    """
    n = len(pixel) * n_samples
    u = r2_sequence(np.arange(n_samples)) + random.random((len(pixel), 1, 2), dtype=np.float32)
    offsets = pixel_filter.offsets(u - np.floor(u)).reshape(n, 2)
    rays = camera.rays(np.repeat(rows(camera.middles, pixel), n_samples, axis=0) + offsets)
    hits = first_hits(tracer, rays)
    left = media_left(tracer, rays, hits)
    held_out = np.flatnonzero(hits.hit)
    held_out = held_out[scene.objects.held_out[scene.object_of_triangle[hits.triangle[held_out]]]]
    hits.put(held_out, Hits.none(len(held_out)))
    hit = np.flatnonzero(hits.hit)
    met = hits.where(hit)
    position, normal = met.points(scene, rows(rays.directions, hit))

    depth = np.full(n, NOTHING)
    depth[hit] = camera.depth(position)
    normals = np.zeros((n, 3), np.float32)
    normals[hit] = lambertian_normals(scene, met.triangle, met.u, met.v, normal)
    first_distance = np.where(hits.hit, hits.distance, np.float32(1))
    facing_area = np.zeros(n, np.float32)
    facing_area[hit] = camera.pixel_area(position)

    key = np.uint64(random.integers(1 << 63))
    paths = followed_paths(scene, tracer, hits, rays.directions, hits.tinted(left), key)
    sample = paths.sample
    grown = (paths.distance / first_distance[sample]) ** 2
    area = facing_area[sample] * grown
    seen = surface_seen(scene, sample // n_samples, paths.hits, paths.directions, area)
    shape = (len(pixel), n_samples)
    return CameraSamples(
        seen=seen,
        share=paths.share,
        throughput=paths.throughput,
        n_followed=paths.n_followed,
        depth=depth.reshape(shape)[:, 0],
        normal=normals.reshape(*shape, 3).mean(axis=1),
        beyond=paths.beyond.reshape(*shape, 3).mean(axis=1),
        transmittance=left.reshape(*shape, 3).mean(axis=1) if tracer.arrays.media.any else None,
    )


def media_left(tracer: TransparencyTracer, rays: CameraRays, hits: Hits) -> np.ndarray:
    """What media leave of light on a camera's rays between their hits, or the end of the clipping, and it, (n, 3)."""
    left = np.ones((len(rays.length), 3), np.float32)
    k = np.flatnonzero(np.isfinite(rays.directions[:, 0])) if tracer.arrays.media.any else np.zeros(0, int)
    if len(k):
        far = np.minimum(hits.distance, rays.length)[k]
        left[k] = tracer.media_left(rows(rays.origins, k), rows(rays.directions, k), far)
    return left
