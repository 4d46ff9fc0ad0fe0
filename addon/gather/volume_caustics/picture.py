"""What a camera sees of points where media scatter light."""

import numpy as np
from scipy.spatial import cKDTree

from ...core.compiling import kernel, part
from ...core.parallel import Workers
from ...core.sampling.path_numbers import PathNumbers
from ...core.sampling.vectors import dot, rows
from ...core.vec3 import ONE, ZERO
from ...receivers import Camera, CameraPoints
from ...tracing import TransparencyTracer
from ...tracing.media.scattering import phase_density
from ..photon_splatting.radius import n_in_splat
from .photon_points import MediaPoints

_NEIGHBOURS = 16  # by which the density is measured: of fewer it would be noisy
_LEAST_RADIUS, _LARGEST_RADIUS = 0.8, 32.0  # pixels
_THINNING = 82  # stream of random numbers


def volume_caustics(
    points: CameraPoints, scattered: MediaPoints, tracer: TransparencyTracer, workers: Workers
) -> tuple[np.ndarray, np.ndarray]:
    """The picture of points where media scatter light, before the first surfaces, and its standard error.

    A point that scatters Φ watts has a share K in each pixel around, which sees it over the area A: L = Σ Φ p T K / A.

    Returns
    -------
    radiance : (height, width, 3) float32, W/(m² sr)
    stderr : (height, width) float32, W/(m² sr)
        Of its mean over colours.
    """
    camera = points.camera
    picture, squares = np.zeros((camera.height, camera.width, 3)), np.zeros((camera.height, camera.width))
    place, depth = camera.places(scattered.position), camera.depth(scattered.position)
    k = np.flatnonzero(np.isfinite(place).all(axis=1) & (depth > camera.clip[0]) & (depth < camera.clip[1]))
    if len(k):
        scattered, place, depth = scattered.where(k), rows(place, k), depth[k]
        radius = _radii(camera, scattered, place, workers.seed)
        reach = np.array([camera.width, camera.height], np.float32) + radius[:, None]
        k = np.flatnonzero(((place > -radius[:, None]) & (place < reach)).all(axis=1))
        scattered, place = scattered.where(k), rows(place, k)
        light = _seen(camera, scattered, place, tracer)
        _splat(place, depth[k], light, radius[k], points.depth, picture, squares)
    return picture.astype(np.float32), np.sqrt(squares).astype(np.float32)


def _seen(camera: Camera, scattered: MediaPoints, place: np.ndarray, tracer: TransparencyTracer) -> np.ndarray:
    """Radiance in the pixel that sees each point, if it has none but this, (n, 3) float32."""
    rays = camera.rays(place.astype(np.float64))
    distance = dot(scattered.position - rays.origins, rays.directions)
    left = tracer.media_left(rays.origins, rays.directions, distance)
    phase = np.empty(len(scattered), np.float32)
    _phase(tracer.arrays.media, scattered.volume, -dot(scattered.direction, rays.directions), phase)
    return scattered.power * left * (phase / camera.pixel_area(scattered.position))[:, None]


@kernel
def _phase(media, volume, cosine, phase):
    """The phase functions of volumes."""
    for i in range(len(volume)):
        phase[i] = phase_density(media, volume[i], cosine[i])


def _radii(camera: Camera, scattered: MediaPoints, place: np.ndarray, seed: int) -> np.ndarray:
    """Radii of splats, pixels, (n,) float32, in which about k points are (`n_in_splat`).

    In the picture; and at a distance d from the camera, where points of a density ρ are bright and few, within about d
    along the ray: π r² d ρ = k.
    """
    k, most = n_in_splat(len(place)), np.float32(max(camera.width, camera.height))
    chosen = PathNumbers(seed, _THINNING).of(scattered.path).random(len(place)) < np.float32(_NEIGHBOURS / k)
    if np.count_nonzero(chosen) <= _NEIGHBOURS:
        return np.full(len(place), _LARGEST_RADIUS, np.float32)
    in_picture, _ = cKDTree(place[chosen]).query(place, [_NEIGHBOURS], distance_upper_bound=_LARGEST_RADIUS)
    in_space, _ = cKDTree(scattered.position[chosen]).query(scattered.position, [_NEIGHBOURS])
    distance = np.linalg.norm(scattered.position - camera.position, axis=1)
    around = np.sqrt(4 / 3 * in_space[:, 0] ** 3 / np.maximum(distance, np.float32(1e-6)))
    pixels = around / np.sqrt(camera.pixel_area(scattered.position))
    radius = np.maximum(np.clip(in_picture[:, 0], _LEAST_RADIUS, _LARGEST_RADIUS), pixels)
    return np.minimum(radius, most).astype(np.float32)


@kernel
def _splat(place, depth, light, radius, first_depth, picture, squares):
    """Add points to the pixels around that see nothing before them, by Epanechnikov's kernel."""
    height, width = first_depth.shape
    for i in range(len(depth)):
        x, y, r = place[i, 0] - np.float32(0.5), place[i, 1] - np.float32(0.5), radius[i]
        left, right = int(np.ceil(x - r)), int(np.floor(x + r))
        top, bottom = int(np.ceil(y - r)), int(np.floor(y + r))
        total = ZERO
        for v in range(top, bottom + 1):
            for u in range(left, right + 1):
                total += _share(np.float32(u) - x, np.float32(v) - y, r)
        if total <= ZERO:
            continue
        mean = (light[i, 0] + light[i, 1] + light[i, 2]) / np.float32(3)
        for v in range(max(top, 0), min(bottom, height - 1) + 1):
            for u in range(max(left, 0), min(right, width - 1) + 1):
                share = _share(np.float32(u) - x, np.float32(v) - y, r) / total
                if share > ZERO and depth[i] < first_depth[v, u]:
                    for c in range(3):
                        picture[v, u, c] += share * light[i, c]
                    squares[v, u] += (share * mean) ** 2


@part
def _share(x, y, r):
    """What a pixel has of a point beside it, not normalised."""
    return max(ONE - (x * x + y * y) / (r * r), ZERO)
