"""What shines where rays end: surfaces and the world."""

import numpy as np

from ..emitters.world import radiance_along
from ..scene import Scene
from .protocol import Hits


def emission_met(scene: Scene, hits: Hits, directions: np.ndarray) -> np.ndarray:
    """Radiance that surfaces emit where rays hit them, and the world where they hit none, (n, 3) float32, W/(m² sr).

    What see-through surfaces on the way leave of it is for the caller to apply.
    """
    radiance = np.zeros((len(directions), 3), np.float32)
    k = np.flatnonzero(hits.hit)
    met = hits.where(k)
    radiance[k] = scene.look_up(scene.materials.emission, met.triangle, met.u, met.v)
    radiance[k] *= scene.objects.emits[scene.object_of_triangle[met.triangle], None]
    k = np.flatnonzero(~hits.hit)
    radiance[k] = radiance_along(scene.world, directions[k])
    return radiance
