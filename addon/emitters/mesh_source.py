"""How emissive meshes emit photons."""

import numpy as np

from ..core.sampling.streams import sobol
from ..core.sampling.vectors import dot
from ..core.sampling.warps import sample_cosine_hemisphere, sample_uniform_triangle, to_world
from ..scene import Scene
from .source import Rays, Source, Sphere
from .target_region import Homeward

_BY_OBJECT = 0.1


class MeshSource(Source):
    """All emissive triangles together; both sides emit, negative light too.

    Attributes
    ----------
    triangles : (e,) int32
        Those that emit.
    chance : (e,) float64
        With which each is chosen: half by power and half by what could arrive in the receivers' region; a tenth of
        it evenly by objects, so that a lamp in a closed room is not starved by a sky outside.
    """

    name, n_cells = "Emissive meshes", (32, 2, 1, 1, 256)

    def __init__(self, scene: Scene, region: Sphere) -> None:
        self._scene, self._region, self.lamp = scene, region, len(scene.lights)
        self.triangles, by_power, power = emissive_triangles(scene)
        self.power, self.importance = power.sum(0), float(np.abs(power).sum())
        arrives = by_power * _share_that_arrives(scene, self.triangles, region)
        _, of = np.unique(scene.object_of_triangle[self.triangles], return_inverse=True)
        of_object = np.bincount(of, by_power)
        by_object = by_power / np.maximum(of_object, 1e-300)[of] / max(int((of_object > 0).sum()), 1)
        by_arrival = arrives / max(arrives.sum(), 1e-300)
        self.chance = (1 - _BY_OBJECT) * (by_power + by_arrival) / 2 + _BY_OBJECT * by_object
        self._cumulative = np.cumsum(self.chance)

    def emit(self, u: np.ndarray) -> Rays:
        """A triangle, a place on it, a side, a cosine-weighted direction; from far away many go to the region."""
        scene = self._scene
        aimed, last = self._halved(u[:, 4])
        # One dimension chooses both triangle and side, so that it stays stratified.
        chosen = last.astype(np.float64) * 2
        front, chosen = chosen < 1, chosen % 1
        k = np.minimum(np.searchsorted(self._cumulative, chosen, side="right"), len(self._cumulative) - 1)
        triangle, place = self.triangles[k], sample_uniform_triangle(u[:, 2:4])
        origins = scene.points(triangle, *place)
        normals = np.where(front[:, None], scene.normals[triangle], -scene.normals[triangle])
        home = Homeward(self._region, u[:, :2], origins)
        directions = home.redirect(to_world(sample_cosine_hemisphere(home.u), normals))
        cosine = np.maximum(np.abs(dot(directions, normals)), np.float32(1e-6))
        per_density = home.per_density(directions, cosine / (2 * np.pi))
        if self.aim:
            directions, per_density = self.aim.redirect(aimed, u[:, :2], origins, directions, per_density)
            cosine = np.abs(dot(directions, normals))
        normals = np.where(dot(directions, normals)[:, None] < 0, -normals, normals)
        flux = cosine * per_density * scene.areas[triangle] / np.maximum(self.chance[k], 1e-300)
        origins = origins + scene.ray_offset(triangle, origins) * normals
        radiance = scene.emission(triangle, *place)
        return Rays(
            origins, directions, (radiance * flux[:, None]).astype(np.float32), scene.object_of_triangle[triangle]
        )


def _share_that_arrives(scene: Scene, triangles: np.ndarray, region: Sphere) -> np.ndarray:
    """Share of all directions that meet a region from where a triangle is nearest to it, (e,)."""
    corners = scene.corners(triangles).astype(np.float64)
    centre = corners.mean(axis=1)
    reach = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1, initial=0)
    nearest = np.maximum(np.linalg.norm(centre - region.centre, axis=1) - reach, max(region.radius, 1e-30))
    sine2 = (region.radius / nearest) ** 2
    return sine2 / (1 + np.sqrt(1 - sine2)) / 2


def emissive_triangles(scene: Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The triangles that emit: index (e,) int32, chance to be chosen by power (e,), power 2π|L|A (e, 3) W.

    Objects that diffuse rays do not see do not shine on diffuse surfaces. The power of textured triangles is a mean
    over some of their points; a tenth of the chance goes by the brightest that they could be, lest none were missed.
    """
    materials = scene.materials
    triangles = np.flatnonzero(scene.shines).astype(np.int32)
    area = 2 * np.pi * scene.areas[triangles, None]
    power = area * _mean_emission(scene, triangles)
    chance = np.abs(power).sum(axis=1)
    chance /= max(chance.sum(), 1e-300)
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
