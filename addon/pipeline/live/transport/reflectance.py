"""What the sides of elements reflect and let through diffusely, as means over their area."""

from dataclasses import dataclass

import numpy as np

from ....bsdf.albedos import total_weight
from ....bsdf.closure import bsdf_at
from ....bsdf.mixture import TRANSLUCENT
from ....core.compiling import kernel
from ....core.vec3 import BLACK, ONE, ZERO, add, put, row, times
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

    @staticmethod
    def none(n_sides: int) -> "Reflectance":
        """Black sides."""
        albedo, translucence = np.zeros((2, n_sides, 3), np.float32)
        return Reflectance(albedo, translucence)

    def find(
        self,
        tracer: TransparencyTracer,
        elements: SurfaceElements,
        key: np.uint64,
        crew: Crew,
        materials: np.ndarray,
        gone: np.ndarray,
    ) -> None:
        """Find that of sides of some materials (m,) bool, as these are now; of objects that are `gone` (o,) nothing."""
        scene, arrays = tracer.arrays.scene, elements.arrays
        triangle = arrays.triangle[arrays.order[arrays.start]]
        sides = np.flatnonzero(np.repeat(materials[scene.material[triangle]], 2))

        def look(chunk: slice) -> None:
            _reflectances(scene, arrays, key, sides, chunk.start, chunk.stop, self.albedo, self.translucence)

        crew.run(Task(len(sides)), _CHUNK, look)
        without = np.repeat(gone[scene.object[triangle]], 2)
        self.albedo[without] = self.translucence[without] = 0


@kernel
def _reflectances(scene, elements, key, sides, start, stop, albedo, translucence):
    """Means over points of sides, each with the weight of its coverage: where there is a hole no ray ends."""
    for i in range(start, stop):
        side, total = sides[i], ZERO
        put(albedo, side, BLACK)
        put(translucence, side, BLACK)
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
