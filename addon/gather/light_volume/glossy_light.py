"""What glossy surfaces reflect of the light in a volume, towards who looks at them."""

import numpy as np

from ...bsdf.mixture import GLOSSY_LOBES
from ...bsdf.scatter import scatter
from ...core.compiling import kernel, kernel_array, part
from ...core.parallel import Workers
from ...core.sampling.path_numbers import path_key, two_numbers
from ...core.sampling.spherical_harmonics import Y0, Y1
from ...core.vec3 import BLACK, dot, mul, plus, put, row, times
from ...receivers import SeenSurface
from ...scene import RayKind, Scene
from ...scene.closures import GLOSSY_KINDS
from ...scene.hit import hit_at
from . import Cascade

_N_SAMPLES = 8  # directions a pixel: light of two bands is smooth
_CHUNK = 1 << 14  # pixels
_CAMERA = int(RayKind.CAMERA)
_SHARE = np.float32(1 / _N_SAMPLES)

_SCATTERING = 72  # stream of random numbers


def glossy_radiance(scene: Scene, seen: SeenSurface, volumes: Cascade, workers: Workers) -> np.ndarray:
    """Radiance ∫ f(ω, ω_o) L(ω) |cos| dω that the glossy lobe sends to the camera: (p, 3) float32, W/(m² sr).

    L is read once in front of the surface; directions ω are sampled by the lobe.
    """
    shiny = scene.materials.has(*GLOSSY_KINDS)[scene.material_of_triangle[seen.hits.triangle]]
    glossy, radiance = np.flatnonzero(shiny), np.zeros((len(seen), 3), np.float32)
    number = path_key(workers.seed, _SCATTERING)

    def reflect(chunk: slice, _: np.random.Generator) -> np.ndarray:
        k = glossy[chunk]
        hits, position, normal = seen.hits.where(k), seen.position[k], seen.normal[k]
        lifted = position + scene.ray_offset(hits.triangle, position) * normal
        light = nowhere_negative(volumes.radiance(lifted, normal)[:, :3])
        arrays = seen.direction[k], kernel_array(light, np.float32), np.empty((len(k), 3), np.float32)
        _reflect(scene.arrays, number, k, hits.triangle, hits.distance, hits.u, hits.v, *arrays)
        return arrays[-1]

    for chunk, value in workers.chunks("Reflecting the volume", len(glossy), _CHUNK, reflect, (_SCATTERING,)):
        radiance[glossy[chunk]] = value
    return radiance


@kernel
def _reflect(scene, number, pixel, triangle, distance, u, v, directions, light, out):
    for i in range(len(pixel)):
        direction, total = row(directions, i), BLACK
        hit = hit_at(scene, direction, triangle[i], distance[i], u[i], v[i])
        for k in range(_N_SAMPLES):
            choice, x = two_numbers(number, pixel[i], 2 * k)
            y, _ = two_numbers(number, pixel[i], 2 * k + 1)
            on = scatter(scene, hit, direction, choice, x, y, GLOSSY_LOBES, False, _CAMERA)
            incoming = _along(light[i, 0], on), _along(light[i, 1], on), _along(light[i, 2], on)
            total = plus(total, mul(on.weight, incoming))
        put(out, i, times(total, _SHARE))


@part
def _along(light, on):
    """What two bands of coefficients, (4,), are in the direction of a `Scattered`."""
    return Y0 * light[0] + Y1 * dot((light[1], light[2], light[3]), on.direction)


def nowhere_negative(radiance: np.ndarray) -> np.ndarray:
    """Coefficients (n, c, 4) with as much of their linear bands as leaves Y₀ L₀ − Y₁ |L₁| ≥ 0 in every direction.

    What two bands make of light from one side is negative on the other, where colours would come out wrong.
    """
    constant, linear = np.maximum(radiance[..., :1], 0), radiance[..., 1:]
    length = np.linalg.norm(linear, axis=-1, keepdims=True)
    share = np.minimum(Y0 * constant / np.maximum(Y1 * length, np.float32(1e-30)), 1)
    return np.concatenate([constant, share * linear], axis=-1)
