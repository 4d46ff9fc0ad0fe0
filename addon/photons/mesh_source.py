"""How emissive meshes emit photons."""

import numpy as np

from ..sampling.streams import sobol
from ..sampling.vectors import dot
from ..sampling.warps import sample_cosine_hemisphere, sample_uniform_triangle, to_world
from ..scene import Scene
from .source import Rays, Source


class MeshSource(Source):
    """All emissive triangles together, each chosen by its power 2π|L|A; both sides emit, negative light too."""

    name, n_cells = "Emissive meshes", (4, 4, 1, 1, 1024)

    def __init__(self, scene: Scene) -> None:
        self._scene, self.lamp = scene, len(scene.lights)
        self._triangles, self._chance, power = emissive_triangles(scene)
        self.power = power.sum(0)
        self._cumulative = np.cumsum(self._chance)

    def emit(self, u: np.ndarray) -> Rays:
        """A triangle by power, a place on it, a side, a cosine-weighted direction."""
        scene = self._scene
        aimed, last = self._halved(u[:, 4])
        # One dimension chooses both triangle and side, so that it stays stratified.
        chosen = last.astype(np.float64) * 2
        front, chosen = chosen < 1, chosen % 1
        k = np.minimum(np.searchsorted(self._cumulative, chosen, side="right"), len(self._cumulative) - 1)
        triangle, place = self._triangles[k], sample_uniform_triangle(u[:, 2:4])
        origins = scene.points(triangle, *place)
        normals = np.where(front[:, None], scene.normals[triangle], -scene.normals[triangle])
        directions = to_world(sample_cosine_hemisphere(u[:, :2]), normals)
        flux = np.full(len(u), 2 * np.pi)  # ∫|cos| dω
        if self.aim:
            per_density = 2 * np.pi / np.maximum(np.abs(dot(directions, normals)), np.float32(1e-6))
            directions, per_density = self.aim.redirect(aimed, u[:, :2], origins, directions, per_density)
            cosine = dot(directions, normals)
            flux, normals = np.abs(cosine) * per_density, np.where(cosine[:, None] < 0, -normals, normals)
        flux *= scene.areas[triangle] / np.maximum(self._chance[k], 1e-300)
        origins = origins + scene.ray_offset(origins) * normals
        radiance = scene.emission(triangle, *place)
        return Rays(
            origins, directions, (radiance * flux[:, None]).astype(np.float32), scene.object_of_triangle[triangle]
        )


def emissive_triangles(scene: Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The triangles that emit: index (e,) int32, chance to be chosen by power (e,), power 2π|L|A (e, 3) W.

    Objects that diffuse rays do not see do not shine on diffuse surfaces. The power of textured triangles is a mean
    over some of their points; a tenth of the chance goes by the brightest that they could be, lest none were missed.
    """
    materials, objects = scene.materials, scene.objects
    shines = objects.scatters & objects.emits
    glows = materials.emission.nonzero[scene.material_of_triangle] & shines[scene.object_of_triangle]
    triangles = np.flatnonzero(glows).astype(np.int32)
    area = 2 * np.pi * scene.areas[triangles, None]
    power = area * _mean_emission(scene, triangles)
    chance = power.sum(axis=1) / max(power.sum(), 1e-300)
    if (materials.emission.textured or materials.coverage.textured) and power.any():
        bound = (area * _brightest(scene)[scene.material_of_triangle[triangles]]).sum(axis=1)
        chance = 0.9 * chance + 0.1 * bound / bound.sum()
    return triangles, chance, power


def _mean_emission(scene: Scene, triangles: np.ndarray) -> np.ndarray:
    """Mean of |L| over triangles, (e, 3) float64, over at least 16 points where they are textured."""
    middle = np.full(len(triangles), 1 / 3, np.float32)
    mean = np.abs(scene.emission(triangles, middle, middle)).astype(np.float64)
    materials = scene.materials
    textured = (materials.emission.texture >= 0) | (materials.coverage.texture >= 0)
    varying = np.flatnonzero(textured[scene.material_of_triangle[triangles]])
    n_points = 1 << int(np.clip(np.log2(_N_POINTS / max(len(varying), 1)), 4, 12))
    u, v = sample_uniform_triangle(sobol(2, 0).random(n_points).astype(np.float32))
    size = _N_POINTS // n_points
    for chunk in (varying[start : start + size] for start in range(0, len(varying), size)):
        triangle = np.repeat(triangles[chunk], n_points)
        radiance = np.abs(scene.emission(triangle, np.tile(u, len(chunk)), np.tile(v, len(chunk))))
        mean[chunk] = radiance.reshape(len(chunk), n_points, 3).mean(axis=1, dtype=np.float64)
    return mean


_N_POINTS = 1 << 20
"""Points at which textured emission is looked at, at a time."""


def _brightest(scene: Scene) -> np.ndarray:
    """The highest |L| that each material may emit, (m, 3) float32."""
    emission, textures = scene.materials.emission, scene.materials.textures
    brightest = np.abs(emission.value)
    if emission.textured:
        textured = emission.texture >= 0
        brightest[textured] *= np.maximum.reduceat(np.abs(textures.pixels), textures.offset)[emission.texture[textured]]
    return brightest
