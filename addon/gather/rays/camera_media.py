"""What media scatter towards a camera: before its rays come to a surface, and behind mirrors and clear glass.

    L(x, ω) = ∫ T(x, y) σs(y) ∫ p(ω' · ω) L(y, ω') dω' dy

over the points y of a ray. Before the first surface direct light is left out, which renders of direct light have: some
rays for each pixel are scattered once for certain, where T σt says, and go on by the phase function as gather rays.
What these meet of lamps, emission and worlds at once is direct light in the medium. Behind mirrors all light counts,
and rays are scattered as gather rays are.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from ...bsdf.albedos import is_mirror
from ...bsdf.closure import bsdf_at
from ...bsdf.mixture import NARROW_LOBES
from ...bsdf.scatter import scatter
from ...core.compiling import kernel
from ...core.parallel import Workers
from ...core.sampling.path_numbers import PathNumbers, two_numbers
from ...core.sampling.sobol import N_DIMENSIONS, sobol_point
from ...core.sampling.vectors import rows
from ...core.vec3 import BLACK, add, along, mul, put, row
from ...receivers import CameraPoints
from ...receivers.camera.camera import CameraRays, first_hits
from ...scene import RayKind, Scene
from ...scene.hit import hit_at
from ...tracing.embree import new_ray
from ...tracing.media.forced import forced_scattering
from ...tracing.media.scattering import sample_phase
from ...tracing.transparency import closest_hit
from .gather_rays import GatherRays
from .in_media import through_media
from .lobe_rays import mean_over_rays

Find = Callable[[GatherRays, np.ndarray, np.ndarray, np.uint64, int], np.ndarray]

_MOST_FOLLOWED = 8  # mirrors and surfaces of glass, as samples are
_STREAM, _SCRAMBLING, _MIRRORED = 77, 78, 79  # of random numbers
_LEAVING = 1 << 15  # of a path's pairs of numbers, the one that chooses the volume
_NUMBERS_A_MIRROR = 64  # of them
_CAMERA = int(RayKind.CAMERA)
_SEEDS = 2.0**32  # of a scrambling


def scattered_in_media(
    points: CameraPoints, rays: GatherRays | None, n_rays: int, workers: Workers
) -> tuple[np.ndarray, np.ndarray]:
    """Radiance that media scatter towards a camera of indirect light, (height, width, 3) float32, and its error.

    Parameters
    ----------
    n_rays : int
        Of a pixel, at least two.

    Returns
    -------
    radiance : (height, width, 3) float32, W/(m² sr)
    stderr : (height, width) float32, W/(m² sr)
        Of its mean over colours.
    """
    assert points.transmittance is not None
    pixel = np.flatnonzero((points.transmittance < 1).any(axis=2))
    stage = "Following light into media"
    return _mean_of_pixels(points, pixel, rays, partial(_met, points), n_rays, stage, _STREAM, workers)


def scattered_in_mirrors(
    scene: Scene, points: CameraPoints, rays: GatherRays | None, n_rays: int, workers: Workers
) -> tuple[np.ndarray, np.ndarray]:
    """Radiance that media scatter of all light, as mirrors and glass show it; otherwise as `scattered_in_media`."""
    pixel = np.arange(points.camera.n_pixels if scene.materials.narrow.any() else 0)
    find, stage = partial(_mirrored, scene, points), "Following mirrors into media"
    return _mean_of_pixels(points, pixel, rays, find, n_rays, stage, _MIRRORED, workers)


def _mean_of_pixels(
    points: CameraPoints,
    pixel: np.ndarray,
    rays: GatherRays | None,
    find: Find,
    n_rays: int,
    stage: str,
    stream: int,
    workers: Workers,
) -> tuple[np.ndarray, np.ndarray]:
    """Pictures of what rays of some pixels find, and of its standard error."""
    shape = points.camera.height, points.camera.width
    radiance, stderr = np.zeros((*shape, 3), np.float32), np.zeros(shape, np.float32)
    if rays is None or len(pixel) == 0 or not rays.tracer.arrays.media.scatters.any():
        return radiance, stderr

    def gather(of_ray: np.ndarray, key: np.uint64, first: int) -> np.ndarray:
        numbers = _numbers(workers.seed, pixel[of_ray[::n_rays]], n_rays)
        return find(rays, pixel[of_ray], numbers, key, first)

    found = mean_over_rays(np.full(len(pixel), n_rays), gather, stage, stream, workers)
    radiance.reshape(-1, 3)[pixel], stderr.reshape(-1)[pixel] = found
    return radiance, stderr


def _numbers(seed: int, pixel: np.ndarray, n_rays: int) -> np.ndarray:
    """Sobol points for the rays of pixels (k,), scrambled anew for each, (k n_rays, 5) float32."""
    scrambling = PathNumbers(seed, _SCRAMBLING).of(pixel).random((len(pixel), N_DIMENSIONS), np.float64)
    seeds = (scrambling * _SEEDS).astype(np.uint64)
    numbers = np.empty((len(pixel) * n_rays, N_DIMENSIONS), np.float32)
    _fill(seeds, n_rays, numbers)
    return numbers


@kernel
def _fill(seeds, n_rays, numbers):
    for i in range(len(numbers)):
        point = sobol_point(seeds, i // n_rays, i % n_rays)
        for d in range(5):
            numbers[i, d] = point[d]


def _camera_rays(points: CameraPoints, pixel: np.ndarray, numbers: np.ndarray) -> CameraRays:
    """Rays through pixels (n,), by the first two of their numbers."""
    camera = points.camera
    return camera.rays(rows(camera.middles, pixel) + points.pixel_filter.offsets(numbers[:, :2]))


def _met(
    points: CameraPoints, rays: GatherRays, pixel: np.ndarray, numbers: np.ndarray, key: np.uint64, first: int
) -> np.ndarray:
    """Radiance that rays through pixels (n,) find, (n, 3), by numbers (n, 5) and those of their paths."""
    tracer, of = rays.tracer, _camera_rays(points, pixel, numbers)
    far = np.minimum(first_hits(tracer, of).distance, of.length)
    origins, directions, weights = np.zeros((3, len(pixel), 3), np.float32)
    _scatter(
        tracer.arrays, new_ray(), of.origins, of.directions, far, numbers, key, first, origins, directions, weights
    )
    radiance = np.zeros((len(pixel), 3), np.float32)
    k = np.flatnonzero(weights.any(axis=1))
    if len(k):
        met = rays.radiance_of_paths(rows(origins, k), rows(directions, k), key, first, RayKind.DIFFUSE)
        radiance[k] = weights[k] * met.reflected
    return radiance


@kernel
def _scatter(tracing, room, starts, ways, far, numbers, key, first, origins, directions, weights):
    """Have media scatter n rays from `starts` along `ways`: to where, in which directions, and with which weights."""
    for i in range(len(far)):
        start, way = row(starts, i), row(ways, i)
        if np.isnan(way[0]):
            continue
        choice, _ = two_numbers(key, first + i, _LEAVING)
        met = forced_scattering(tracing, room, start, way, far[i], numbers[i, 2], choice)
        if met.volume < 0:
            continue
        put(origins, i, along(start, met.distance, way))
        put(directions, i, sample_phase(tracing.media, met.volume, way, numbers[i, 3], numbers[i, 4]))
        put(weights, i, met.weight)


def _mirrored(
    scene: Scene,
    points: CameraPoints,
    rays: GatherRays,
    pixel: np.ndarray,
    numbers: np.ndarray,
    key: np.uint64,
    first: int,
) -> np.ndarray:
    """What media scatter onto rays through pixels (n,) where mirrors and glass have sent them; as `_met`."""
    tracer, of = rays.tracer, _camera_rays(points, pixel, numbers)
    hits = first_hits(tracer, of)
    k = np.flatnonzero(hits.hit)
    k = k[scene.materials.narrow[scene.material_of_triangle[hits.triangle[k]]]]
    n, hits, ways = len(k), hits.where(k), rows(of.directions, k)
    left = (
        hits.tinted(tracer.media_left(rows(of.origins, k), ways, hits.distance)) if n else np.ones((0, 3), np.float32)
    )
    kinds, met = np.zeros(n, np.uint8), np.zeros((n, 3), np.float32)
    on = np.zeros((n, 3), np.float32), ways, kinds, hits.triangle, hits.distance, hits.u, hits.v, left
    _follow_mirrors(tracer.arrays, new_ray(), rays.light, key, first, on, met)
    radiance = np.zeros((len(pixel), 3), np.float32)
    scattered = np.flatnonzero(left.any(axis=1))
    if len(scattered):
        met[scattered] += rays.followed(tuple(rows(one, scattered) for one in on), key, first)
    radiance[k] = met
    return radiance


@kernel
def _follow_mirrors(tracing, room, light, key, first, rays, radiance):
    """Follow n rays over mirrors and glass until media scatter them: what is left of others is black.

    What media bring onto them on the way is added to `radiance`.
    """
    origins, directions, kinds, triangles, distances, us, vs, throughputs = rays
    scene = tracing.scene
    for k in range(len(triangles)):
        origin, direction, kind, throughput = row(origins, k), row(directions, k), _CAMERA, row(throughputs, k)
        triangle, distance, u, v = triangles[k], distances[k], us[k], vs[k]
        scattered = False
        for step in range(_MOST_FOLLOWED):
            if triangle < 0:
                break
            hit = hit_at(scene, direction, triangle, distance, u, v)
            if not is_mirror(scene, bsdf_at(scene, hit, kind)):
                break
            i = _LEAVING + _NUMBERS_A_MIRROR * (step + 1)
            choice, _ = two_numbers(key, first + k, i)
            a, b = two_numbers(key, first + k, i + 1)
            on = scatter(scene, hit, direction, choice, a, b, NARROW_LOBES, False, kind)
            if not on.alive:
                break
            triangle, distance, u, v, tint = closest_hit(tracing, room, on.origin, on.direction, on.kind)
            way = on.origin, on.direction, np.int64(on.kind), triangle, distance, u, v, mul(throughput, on.weight)
            scattered, met, way = through_media(tracing, room, light, key, first + k, i, way)
            add(radiance, k, met)
            origin, direction, kind, triangle, distance, u, v, throughput = way
            if scattered:
                break
            throughput = mul(throughput, tint)
        put(throughputs, k, throughput if scattered else BLACK)
        put(origins, k, origin)
        put(directions, k, direction)
        kinds[k], triangles[k], distances[k], us[k], vs[k] = kind, triangle, distance, u, v
