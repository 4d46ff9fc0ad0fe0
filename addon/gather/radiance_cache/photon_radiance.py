"""Photons on surface elements: the radiance that they add up to, and how much each matters to gather rays."""

import numpy as np

from ...bsdf.albedos import broad_albedo, received_by_body, total_weight, weight_received
from ...bsdf.closure import bsdf_of, seen_from_behind
from ...bsdf.mixture import BROAD_LOBES, DIFFUSE, SUBSURFACE, TRANSLUCENT
from ...bsdf.scatter import shading_normal_correction
from ...core.compiling import kernel, part
from ...core.parallel import slices
from ...core.vec3 import ZERO, add, dot, mean, mul, negative, plus, row, times
from ...photons import PathKind, Photons
from ...scene import RayKind, Scene
from ...scene.hit import barycentrics, shading_normal_at
from .elements import SurfaceElements, element_at

_CHUNK = 1 << 17
_CAUSTIC, _DIFFUSE_RAY = int(PathKind.CAUSTIC), int(RayKind.DIFFUSE)
_VIEW = np.float32(np.sqrt(0.75)), ZERO, np.float32(0.5)  # one at 60° stands for all


def photon_radiance(
    scene: Scene, photons: Photons, elements: SurfaceElements, coverage: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Diffuse radiance that photons make of the sides they fell on and of those behind, Σ ρΦ/(πAc).

    Parameters
    ----------
    coverage : (2 e,) float32
        c, the share of each element that stops light.

    Returns
    -------
    caustic, others : (2 e, 3) float32, W/(m² sr)
        That of caustics, and of all others.
    """
    sums = np.zeros((2, 2 * len(elements), 3))
    for chunk in slices(len(photons), _CHUNK):
        some = photons.where(chunk)
        at = some.triangle, some.position, some.normal
        _add_photons(scene.arrays, elements.arrays, *at, some.direction, some.power, some.kind, *sums)
    caustic, others = (sums / (np.pi * np.repeat(elements.areas, 2) * coverage)[:, None]).astype(np.float32)
    return caustic, others


def photon_incidence(
    scene: Scene, photons: Photons, elements: SurfaceElements, coverage: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Mean radiance of what comes to each side by photons, ΣΦ/(πAc): of all, and of caustics alone.

    Parameters and shapes are those of `photon_radiance`.
    """
    sums = np.zeros((2, 2 * len(elements), 3))
    for chunk in slices(len(photons), _CHUNK):
        some = photons.where(chunk)
        at = some.triangle, some.position, some.normal
        _add_incident(scene.arrays, elements.arrays, *at, some.direction, some.power, some.kind, *sums)
    caustic, others = (sums / (np.pi * np.repeat(elements.areas, 2) * coverage)[:, None]).astype(np.float32)
    return caustic + others, caustic


def photon_importance(
    scene: Scene, photons: Photons, elements: SurfaceElements, hits_per_area: np.ndarray
) -> np.ndarray:
    """Power that is reflected, mean over colours, × `hits_per_area` (2 e,) of the side it falls on, (p,) float64.

    Of caustics all power counts: they light receivers themselves, whatever the surface reflects.
    """
    importance = np.empty(len(photons))
    for chunk in slices(len(photons), _CHUNK):
        some = photons.where(chunk)
        at = some.triangle, some.position, some.normal, some.power, some.kind
        _importance(scene.arrays, elements.arrays, hits_per_area, *at, importance[chunk])
    return importance


@part
def _side_at(elements, triangle, u, v, front, normal):
    """The side of an element that a photon fell on: `front` is the triangle's normal, `normal` that of the side."""
    return 2 * element_at(elements, triangle, u, v) + np.int32(dot(front, normal) < ZERO)


@part
def _arriving(scene, bsdf, power, direction):
    """Power of a photon on the normal on which the light of its side is measured (`lit_normal`)."""
    lit = bsdf.normal
    if not bsdf.perturbed:
        lit = shading_normal_at(scene, bsdf.triangle, bsdf.u, bsdf.v, bsdf.normal, bsdf.back)
    return times(power, shading_normal_correction(lit, bsdf.normal, direction))


@kernel
def _add_incident(scene, elements, triangle, position, normal, direction, power, kind, caustic, others):
    """Add the power of photons to the sums of their sides, (2 e, 3) float64."""
    for k in range(len(triangle)):
        t = triangle[k]
        u, v = barycentrics(scene, t, row(position, k))
        side = _side_at(elements, t, u, v, row(scene.normals, t), row(normal, k))
        bsdf = bsdf_of(scene, t, u, v, side % 2 == 1)
        flown = row(direction, k)
        arriving = _arriving(scene, bsdf, row(power, k), flown)
        if scene.materials.subsurface[scene.material[t]]:
            arriving = times(arriving, received_by_body(scene, bsdf, negative(flown)))
        add(caustic if kind[k] == _CAUSTIC else others, side, arriving)


@kernel
def _add_photons(scene, elements, triangle, position, normal, direction, power, kind, caustic, others):
    """Add what photons make of elements, ρΦ, to the sums of both sides, (2 e, 3) float64."""
    for k in range(len(triangle)):
        t, front = triangle[k], row(scene.normals, triangle[k])
        u, v = barycentrics(scene, t, row(position, k))
        side = _side_at(elements, t, u, v, front, row(normal, k))
        back = side % 2 == 1
        bsdf, flown = bsdf_of(scene, t, u, v, back), row(direction, k)
        arriving = _arriving(scene, bsdf, row(power, k), flown)
        sums, towards = caustic if kind[k] == _CAUSTIC else others, negative(flown)
        behind = seen_from_behind(scene, bsdf, _DIFFUSE_RAY)
        add(sums, side, mul(weight_received(scene, bsdf, DIFFUSE, towards), arriving))
        add(sums, side ^ 1, mul(weight_received(scene, behind, TRANSLUCENT, towards), arriving))


@kernel
def _importance(scene, elements, hits_per_area, triangle, position, normal, power, kind, importance):
    """`photon_importance` of photons."""
    for k in range(len(triangle)):
        t, light = triangle[k], row(power, k)
        u, v = barycentrics(scene, t, row(position, k))
        side = _side_at(elements, t, u, v, row(scene.normals, t), row(normal, k))
        light = abs(light[0]), abs(light[1]), abs(light[2])
        if kind[k] != _CAUSTIC:
            bsdf = bsdf_of(scene, t, u, v, side % 2 == 1)
            through = total_weight(scene, seen_from_behind(scene, bsdf, _DIFFUSE_RAY), TRANSLUCENT)
            scattered = plus(total_weight(scene, bsdf, DIFFUSE), through)
            if scene.materials.subsurface[scene.material[t]]:
                scattered = plus(scattered, total_weight(scene, bsdf, SUBSURFACE))
            if scene.materials.broad[scene.material[t]]:
                scattered = plus(scattered, broad_albedo(scene, bsdf, _VIEW, BROAD_LOBES))
            light = mul(scattered, light)
        importance[k] = mean(light) * hits_per_area[side]
