"""The direct pass: all direct light at receivers, and how it changes with their normals."""

import numpy as np

from ...core.parallel import Workers
from ...core.sampling.path_numbers import path_key
from ...receivers import Receivers
from ...scene import Scene
from ..normal_gradient import slope_of_samples
from ..on_bodies import OnBodies, arrivals
from .direct_light import DirectLight
from .ray_directions import gather_directions

N_SAMPLES = 64
_STAGE = "Adding direct light"
_CHUNK = 256  # receivers
_AT_RECEIVERS, _AT_TURNED = 31, 32  # streams of random numbers


def direct_irradiance(scene: Scene, direct: DirectLight, receivers: Receivers, workers: Workers) -> np.ndarray:
    """Direct irradiance of receivers, the world's among it, mean of `N_SAMPLES` estimates, (n, 3) float32, W/m²."""
    of_receiver, key = _objects(scene, receivers), path_key(workers.seed, _AT_RECEIVERS)
    on = OnBodies.of(scene, direct.tracer.surfaces, receivers)

    def estimate(chunk: slice, _: np.random.Generator) -> np.ndarray:
        at = receivers.position[chunk], receivers.normal[chunk], of_receiver[chunk]
        bases = None if receivers.base_normal is None else receivers.base_normal[chunk]
        if on is not None and on.there[chunk].any():
            return _through_bodies(direct, on.where(chunk), *at, bases, key, chunk.start)
        return direct.mean_irradiance(*at, N_SAMPLES, key, chunk.start, bases=bases)

    irradiance = np.zeros((len(receivers), 3), np.float32)
    for chunk, value in workers.chunks(_STAGE, len(receivers), _CHUNK, estimate, (_AT_RECEIVERS,)):
        irradiance[chunk] = value
    return irradiance


def _through_bodies(
    direct: DirectLight,
    on: OnBodies,
    positions: np.ndarray,
    normals: np.ndarray,
    objects: np.ndarray,
    bases: np.ndarray | None,
    key: np.uint64,
    first: int,
) -> np.ndarray:
    """The same of receivers some of which are on bodies, an estimate at each of `N_SAMPLES` arrivals."""
    bases, first = np.zeros((0, 3), np.float32) if bases is None else bases, first * N_SAMPLES
    came = arrivals(direct.tracer, on, positions, normals, bases, N_SAMPLES, key, first)
    at = came.position, came.normal, np.repeat(objects, N_SAMPLES)
    light = came.weight * direct.mean_irradiance(*at, 1, key, first, bases=came.base)
    mean: np.ndarray = light.reshape(-1, N_SAMPLES, 3).mean(axis=1)
    return mean


def direct_slope(
    scene: Scene, direct: DirectLight, receivers: Receivers, irradiance: np.ndarray, workers: Workers
) -> np.ndarray:
    """How the direct irradiance (n, 3) of receivers changes with their normals, (n, 3, 3) float32, W/m².

    By its definition (`normal_gradient`), from an estimate of the irradiance for each of `N_SAMPLES` turned normals.
    """
    of_receiver, key = _objects(scene, receivers), path_key(workers.seed, _AT_TURNED)
    on = OnBodies.of(scene, direct.tracer.surfaces, receivers)

    def estimate(chunk: slice, random: np.random.Generator) -> np.ndarray:
        at, first = (receivers.position[chunk], receivers.normal[chunk]), N_SAMPLES * chunk.start
        positions, normals, objects = (np.repeat(of, N_SAMPLES, 0) for of in (*at, of_receiver[chunk]))
        turned = gather_directions(normals, N_SAMPLES, random)
        if on is not None and on.there[chunk].any():
            came = arrivals(direct.tracer, on.where(chunk), *at, at[1], N_SAMPLES, key, first)
            there = came.position, came.turned(turned, normals), objects
            change = came.weight * direct.mean_irradiance(*there, 1, key, first)
        else:
            change = direct.mean_irradiance(positions, turned, objects, 1, key, first)
        change = change.reshape(-1, N_SAMPLES, 3) - irradiance[chunk, None]
        return slope_of_samples(change, turned.reshape(-1, N_SAMPLES, 3), receivers.normal[chunk])

    slope = np.zeros((len(receivers), 3, 3), np.float32)
    for chunk, value in workers.chunks(_STAGE, len(receivers), _CHUNK, estimate, (_AT_TURNED,)):
        slope[chunk] = value
    return slope


def _objects(scene: Scene, receivers: Receivers) -> np.ndarray:
    """The scene's object that each receiver is on, (n,) int; −1 where there is none, as for what no rays see."""
    objects = np.full(len(receivers), -1)
    for target in receivers.targets:
        if target.object_name in scene.objects.names:
            on = target.receiver_of_element[target.receiver_of_element >= 0]
            objects[on] = scene.objects.names.index(target.object_name)
    return objects
