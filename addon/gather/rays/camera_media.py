"""What media scatter towards a camera before its rays come to a surface: all but direct light, which renders have.

    L(x, ω) = ∫ T(x, y) σs(y) ∫ p(ω' · ω) L(y, ω') dω' dy

over the points y of a ray. Some rays for each pixel are scattered once for certain, where T σt says, and go on by the
phase function as gather rays. What these meet of lamps, emission and worlds at once is direct light in the medium.
"""

import numpy as np

from ...core.compiling import kernel
from ...core.parallel import Workers
from ...core.sampling.path_numbers import PathNumbers, two_numbers
from ...core.sampling.sobol import N_DIMENSIONS, sobol_point
from ...core.sampling.vectors import rows
from ...core.vec3 import along, put, row
from ...receivers import CameraPoints
from ...receivers.camera.camera import first_hits
from ...scene import RayKind
from ...tracing.embree import new_ray
from ...tracing.media.forced import forced_scattering
from ...tracing.media.scattering import sample_phase
from .gather_rays import GatherRays
from .lobe_rays import mean_over_rays

_STREAM, _SCRAMBLING = 77, 78  # of random numbers
_LEAVING = 1 << 15  # of a path's pairs of numbers, the one that chooses the volume
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
    shape = points.camera.height, points.camera.width
    radiance, stderr = np.zeros((*shape, 3), np.float32), np.zeros(shape, np.float32)
    assert points.transmittance is not None
    pixel = np.flatnonzero((points.transmittance < 1).any(axis=2))
    if rays is None or len(pixel) == 0 or not rays.tracer.arrays.media.scatters.any():
        return radiance, stderr

    def gather(of_ray: np.ndarray, key: np.uint64, first: int) -> np.ndarray:
        numbers = _numbers(workers.seed, pixel[of_ray[::n_rays]], n_rays)
        return _met(points, rays, pixel[of_ray], numbers, key, first)

    counts = np.full(len(pixel), n_rays)
    found = mean_over_rays(counts, gather, "Following light into media", _STREAM, workers)
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


def _met(
    points: CameraPoints, rays: GatherRays, pixel: np.ndarray, numbers: np.ndarray, key: np.uint64, first: int
) -> np.ndarray:
    """Radiance that rays through pixels (n,) find, (n, 3), by numbers (n, 5) and those of their paths."""
    camera, tracer = points.camera, rays.tracer
    of = camera.rays(rows(camera.middles, pixel) + points.pixel_filter.offsets(numbers[:, :2]))
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
