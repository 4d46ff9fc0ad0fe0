"""What the sides of elements reflect and let through diffusely, as means over their area."""

from dataclasses import dataclass

import numpy as np

from ....bsdf.albedos import total_weight
from ....bsdf.closure import bsdf_at
from ....bsdf.mixture import TRANSLUCENT
from ....core.compiling import kernel
from ....core.vec3 import ONE, ZERO, add, put, row, times
from ....gather.radiance_cache.elements import SurfaceElements
from ....gather.radiance_cache.lit_sides import point_of_side
from ....scene import RayKind
from ....scene.hit import look_up
from ....tracing import TransparencyTracer
from ..crew import Crew, Task
from .links import matte_albedo

_N_POINTS = 8
_CHUNK = 1 << 10  # sides
_POINT = (1 << 15) + 16  # of a path's pairs of numbers
_VIEW = np.float32(np.sqrt(0.75)), ZERO, np.float32(0.5)  # as any
_DIFFUSE, _LEAST = int(RayKind.DIFFUSE), np.float32(1e-3)


@dataclass
class Reflectance:
    """Of the s sides of elements.

    Attributes
    ----------
    albedo, translucence : (s, 3) float32
        What a side reflects of its own irradiance, and lets through of that of its other side.
    """

    albedo: np.ndarray
    translucence: np.ndarray


def reflectance(tracer: TransparencyTracer, elements: SurfaceElements, key: np.uint64, crew: Crew) -> Reflectance:
    """That of all sides, from the materials as they are now."""
    albedo, translucence = np.zeros((2, 2 * len(elements), 3), np.float32)
    scene, arrays = tracer.arrays.scene, elements.arrays

    def look(chunk: slice) -> None:
        _reflectances(scene, arrays, key, chunk.start, chunk.stop, albedo, translucence)

    crew.run(Task(len(albedo)), _CHUNK, look)
    return Reflectance(albedo, translucence)


@kernel
def _reflectances(scene, elements, key, start, stop, albedo, translucence):
    """Means over points of sides, each with the weight of its coverage: where there is a hole no ray ends."""
    for side in range(start, stop):
        total = ZERO
        for k in range(_N_POINTS):
            hit = point_of_side(scene, elements, side, key, side * _N_POINTS + k, _POINT)
            bsdf = bsdf_at(scene, hit, _DIFFUSE)
            covered = look_up(scene, scene.materials.coverage, hit.triangle, hit.u, hit.v, hit.back, _DIFFUSE)[0]
            covered = max(covered, _LEAST)
            add(albedo, side, times(matte_albedo(scene, bsdf, _VIEW), covered))
            add(translucence, side, times(total_weight(scene, bsdf, TRANSLUCENT), covered))
            total += covered
        put(albedo, side, times(row(albedo, side), ONE / total))
        put(translucence, side, times(row(translucence, side), ONE / total))
