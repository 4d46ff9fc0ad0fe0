"""The direct pass: all direct light at receivers."""

import numpy as np

from ..parallel import Workers
from ..receivers import Receivers
from ..scene import Scene
from .direct_light import DirectLight

N_SAMPLES = 64
_AT_RECEIVERS = 31  # stream of random numbers


def direct_irradiance(scene: Scene, direct: DirectLight, receivers: Receivers, workers: Workers) -> np.ndarray:
    """Direct irradiance of receivers, the world's among it, mean of `N_SAMPLES` estimates, (n, 3) float32, W/m²."""
    of_receiver = _objects(scene, receivers)

    def estimate(chunk: slice, random: np.random.Generator) -> np.ndarray:
        positions, normals, objects = (
            np.repeat(of[chunk], N_SAMPLES, 0) for of in (receivers.position, receivers.normal, of_receiver)
        )
        return direct.irradiance_with_sky(positions, normals, objects, random).reshape(-1, N_SAMPLES, 3).mean(axis=1)

    irradiance = np.zeros((len(receivers), 3), np.float32)
    for chunk, value in workers.chunks("Adding direct light", len(receivers), 1024, estimate, (_AT_RECEIVERS,)):
        irradiance[chunk] = value
    return irradiance


def _objects(scene: Scene, receivers: Receivers) -> np.ndarray:
    """The scene's object that each receiver is on, (n,) int; −1 where there is none, as for what no rays see."""
    objects = np.full(len(receivers), -1)
    for target in receivers.targets:
        if target.object_name in scene.objects.names:
            on = target.receiver_of_element[target.receiver_of_element >= 0]
            objects[on] = scene.objects.names.index(target.object_name)
    return objects
