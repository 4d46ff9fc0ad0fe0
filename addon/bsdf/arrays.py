"""The functions of the mixture and its albedos for many points at a time that a camera sees: loops over its parts."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.compiling import kernel, kernel_array, part
from ..core.sampling.vectors import rows
from ..core.vec3 import ONE, ZERO, negative, put, row
from ..scene import Scene
from ..scene.arrays import SceneArrays
from ..scene.hit import hit_at
from . import albedos, mixture
from .closure import seen_by_camera
from .scatter import lambertian_normal


@dataclass(frozen=True)
class Surface:
    """n points on surfaces of a scene, seen from one of their sides.

    Attributes
    ----------
    scene : SceneArrays
    triangle : (n,) int32
    u, v : (n,) float32
        Barycentric coordinates.
    back : (n,) bool
        Whether the points are seen from the back.
    """

    scene: SceneArrays
    triangle: np.ndarray
    u: np.ndarray
    v: np.ndarray
    back: np.ndarray

    def __len__(self) -> int:
        return len(self.triangle)

    def where(self, chosen: np.ndarray) -> "Surface":
        """The points that `chosen` (indices or a mask) selects."""
        return Surface(self.scene, *(rows(column, chosen) for column in self._at))

    @property
    def _at(self) -> tuple[np.ndarray, ...]:
        return self.triangle, self.u, self.v, self.back

    def asked(
        self, loop: Any, *arguments: Any, columns: tuple[int, ...] = (3,), dtype: type = np.float32
    ) -> np.ndarray:
        """What a kernel writes for the points, (n, *columns)."""
        out: np.ndarray = np.empty((len(self), *columns), dtype)
        loop(self.scene, *self._at, *arguments, out)
        return out


def surface_at(scene: Scene, triangle: np.ndarray, u: np.ndarray, v: np.ndarray, back: np.ndarray) -> Surface:
    """The surface at barycentric coordinates (u, v) of triangles, (n,) each, seen from the back where `back` is."""
    f = np.float32
    at = (kernel_array(triangle, np.int32), kernel_array(u, f), kernel_array(v, f), kernel_array(back, np.bool_))
    return Surface(scene.arrays, *at)


def evaluate_glossy(surface: Surface, wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
    """The f of the rough glossy lobes, 1/sr, (n, 3), of local directions (n, 3); wo is the viewing side."""
    return surface.asked(_evaluate_glossy, kernel_array(wo, np.float32), kernel_array(wi, np.float32))


def diffuse_albedo(surface: Surface, cos: np.ndarray) -> np.ndarray:
    """What layers leave of the diffuse albedo of points seen at cosines (n,), (n, 3)."""
    return surface.asked(_diffuse_albedo, kernel_array(cos, np.float32))


def translucent_albedo(surface: Surface, cos: np.ndarray) -> np.ndarray:
    """What layers leave of the translucent albedo, (n, 3)."""
    return surface.asked(_translucent_albedo, kernel_array(cos, np.float32))


def glossy_albedo(surface: Surface, cos: np.ndarray) -> np.ndarray:
    """What the glossy lobes reflect in all, (n, 3)."""
    return surface.asked(_glossy_albedo, kernel_array(cos, np.float32))


def lambertian_normals(
    scene: Scene, triangle: np.ndarray, u: np.ndarray, v: np.ndarray, normals: np.ndarray
) -> np.ndarray:
    """The mean of the normals of each point's Lambertian closures by their weights, unit vectors (n, 3) float32.

    Parameters
    ----------
    normals : (n, 3) float32
        Geometric normals of the sides.
    """
    f, out = np.float32, np.empty((len(triangle), 3), np.float32)
    at = kernel_array(triangle, np.int32), kernel_array(u, f), kernel_array(v, f)
    _lambertian_normals(scene.arrays, *at, kernel_array(normals, f), out)
    return out


def reflects_highlights(surface: Surface) -> np.ndarray:
    """Whether a glossy lobe is rough enough for shadow rays to find light by it, (n,) bool."""
    return surface.asked(_reflects_highlights, columns=(), dtype=np.bool_)


@part
def _seen_at(cos):
    """A local direction at a cosine to +z."""
    return np.sqrt(max(ONE - cos * cos, ZERO)), ZERO, cos


@kernel
def _evaluate_glossy(scene, triangle, u, v, back, wo, wi, out):
    for i in range(len(triangle)):
        bsdf = seen_by_camera(scene, triangle[i], u[i], v[i], back[i])
        put(out, i, mixture.evaluate_glossy(scene, bsdf, row(wo, i), row(wi, i)))


@kernel
def _diffuse_albedo(scene, triangle, u, v, back, cos, out):
    for i in range(len(triangle)):
        bsdf = seen_by_camera(scene, triangle[i], u[i], v[i], back[i])
        put(out, i, albedos.diffuse_albedo(scene, bsdf, _seen_at(cos[i])))


@kernel
def _translucent_albedo(scene, triangle, u, v, back, cos, out):
    for i in range(len(triangle)):
        bsdf = seen_by_camera(scene, triangle[i], u[i], v[i], back[i])
        put(out, i, albedos.translucent_albedo(scene, bsdf, _seen_at(cos[i])))


@kernel
def _glossy_albedo(scene, triangle, u, v, back, cos, out):
    for i in range(len(triangle)):
        bsdf = seen_by_camera(scene, triangle[i], u[i], v[i], back[i])
        put(out, i, albedos.glossy_albedo(scene, bsdf, _seen_at(cos[i])))


@kernel
def _reflects_highlights(scene, triangle, u, v, back, out):
    for i in range(len(triangle)):
        out[i] = albedos.reflects_highlights(scene, seen_by_camera(scene, triangle[i], u[i], v[i], back[i]))


@kernel
def _lambertian_normals(scene, triangle, u, v, normals, out):
    for i in range(len(triangle)):
        hit = hit_at(scene, negative(row(normals, i)), triangle[i], ONE, u[i], v[i])
        put(out, i, lambertian_normal(scene, hit))
