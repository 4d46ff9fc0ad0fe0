"""The direct pass: all direct light at receivers, and how it changes with their normals."""

import numpy as np

from ...core.compiling import kernel, kernel_array
from ...core.parallel import Workers
from ...core.sampling.path_numbers import path_key
from ...core.vec3 import BLACK, dot, minus, plus, put, row, times
from ...receivers import Receivers
from ...scene import Scene
from ...tracing.embree import new_ray
from .direct_light import DirectLight
from .ray_directions import gather_directions
from .visible import direct_light

N_SAMPLES = 64
_STAGE = "Adding direct light"
_CHUNK = 256  # receivers
_AT_RECEIVERS, _AT_TURNED = 31, 32  # streams of random numbers
_TWO, _FOUR, _PER_SAMPLE = np.float32(2), np.float32(4), np.float32(1 / N_SAMPLES)


def direct_irradiance(scene: Scene, direct: DirectLight, receivers: Receivers, workers: Workers) -> np.ndarray:
    """Direct irradiance of receivers, the world's among it, mean of `N_SAMPLES` estimates, (n, 3) float32, W/m²."""
    arrays, tracing, key = direct.arrays, direct.tracer.arrays, path_key(workers.seed, _AT_RECEIVERS)
    at, irradiance = _points(scene, receivers), np.zeros((len(receivers), 3), np.float32)

    def estimate(chunk: slice, _: np.random.Generator) -> None:
        _light(arrays, tracing, new_ray(), *at, key, chunk.start, chunk.stop, irradiance)

    for _ in workers.chunks(_STAGE, len(receivers), _CHUNK, estimate, (_AT_RECEIVERS,)):
        pass
    return irradiance


def direct_slope(
    scene: Scene, direct: DirectLight, receivers: Receivers, irradiance: np.ndarray, workers: Workers
) -> np.ndarray:
    """How the direct irradiance (n, 3) of receivers changes with their normals, (n, 3, 3) float32, W/m².

    By its definition (`normal_gradient`), from an estimate of the irradiance for each of `N_SAMPLES` turned normals:
    rows are axes of space, columns colours.
    """
    arrays, tracing, key = direct.arrays, direct.tracer.arrays, path_key(workers.seed, _AT_TURNED)
    at, slope = (*_points(scene, receivers), kernel_array(irradiance, np.float32)), np.zeros((len(receivers), 3, 3))

    def estimate(chunk: slice, random: np.random.Generator) -> None:
        turned = gather_directions(np.repeat(receivers.normal[chunk], N_SAMPLES, 0), N_SAMPLES, random)
        _slopes(arrays, tracing, new_ray(), *at, turned, key, chunk.start, chunk.stop, slope)

    for _ in workers.chunks(_STAGE, len(receivers), _CHUNK, estimate, (_AT_TURNED,)):
        pass
    return slope.astype(np.float32)


def _points(scene: Scene, receivers: Receivers) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Receivers' positions and normals, and the scene's objects that they are on, (n,) int32.

    −1 where there is none, as for what no rays see.
    """
    objects = np.full(len(receivers), -1, np.int32)
    for target in receivers.targets:
        if target.object_name in scene.objects.names:
            on = target.receiver_of_element[target.receiver_of_element >= 0]
            objects[on] = scene.objects.names.index(target.object_name)
    return kernel_array(receivers.position, np.float32), kernel_array(receivers.normal, np.float32), objects


@kernel
def _light(direct, tracing, room, positions, normals, objects, key, start, stop, irradiance):
    for k in range(start, stop):
        position, normal, total = row(positions, k), row(normals, k), BLACK
        for path in range(k * N_SAMPLES, (k + 1) * N_SAMPLES):
            light = direct_light(direct, tracing, room, position, normal, objects[k], key, path, 0, True)
            total = plus(total, light)
        put(irradiance, k, times(total, _PER_SAMPLE))


@kernel
def _slopes(direct, tracing, room, positions, normals, objects, irradiance, turned, key, start, stop, slope):
    """B = mean of (E(n') − E(n)) (4 d + 2 (d·n) n), d = n' − n, over the normals n' `turned` of `start` to `stop`."""
    for k in range(start, stop):
        position, normal, level = row(positions, k), row(normals, k), row(irradiance, k)
        for i in range(N_SAMPLES):
            n = row(turned, (k - start) * N_SAMPLES + i)
            light = direct_light(direct, tracing, room, position, n, objects[k], key, k * N_SAMPLES + i, 0, True)
            change, away = times(minus(light, level), _PER_SAMPLE), minus(n, normal)
            weight = plus(times(away, _FOUR), times(normal, _TWO * dot(away, normal)))
            for axis in range(3):
                for colour in range(3):
                    slope[k, axis, colour] += weight[axis] * change[colour]
