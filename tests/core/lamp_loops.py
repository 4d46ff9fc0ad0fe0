"""Lamps as many points sample them, and as many rays meet them: loops over the parts in `lamps`."""

from dataclasses import dataclass

import numpy as np
from photon_bake.addon.core.compiling import kernel, kernel_array
from photon_bake.addon.core.vec3 import put, row
from photon_bake.addon.emitters.lamps import lamp_arrays, meet_lamp, radiance_of_lamps, sample_lamp
from photon_bake.addon.scene import Lights


@dataclass(frozen=True)
class LampHits:
    """Where n rays meet one lamp each.

    Attributes
    ----------
    distance : (n,) float32, m
        Infinite where a ray misses its lamp.
    radiance : (n, 3) float32, W/(m² sr)
    density : (n,) float32, 1/sr
        With which `sample_lamp` finds the ray's direction from its origin; infinite where the lamp is missed.
    """

    distance: np.ndarray
    radiance: np.ndarray
    density: np.ndarray


@kernel
def _sample(lamps, lamp, positions, normals, u, far, targets, irradiance):
    for k in range(len(lamp)):
        target, light = sample_lamp(lamps, lamp[k], row(positions, k), row(normals, k), u[k, 0], u[k, 1], far)
        put(targets, k, target)
        put(irradiance, k, light)


def light_samples(
    lights: Lights, lamp: np.ndarray, positions: np.ndarray, normals: np.ndarray, u: np.ndarray, far: float
) -> tuple[np.ndarray, np.ndarray]:
    """A point on a lamp (n,) for each of n positions, and what it gives there if nothing is between.

    Parameters
    ----------
    positions, normals : (n, 3) float32
        World space, m; unit normals of the sides that are lit.
    u : (n, 2) float32
        Points of the unit square.
    far : float, m
        How far away suns are.

    Returns
    -------
    targets, irradiance : (n, 3) float32, m and W/m²
        The irradiance is over the density of the point on its lamp: its mean is the lamp's.
    """
    targets, irradiance = np.empty((2, len(lamp), 3), np.float32)
    numbers, (x, n, u) = kernel_array(lamp, np.int32), (kernel_array(a, np.float32) for a in (positions, normals, u))
    _sample(lamp_arrays(lights), numbers, x, n, u, np.float32(far), targets, irradiance)
    return targets, irradiance


@kernel
def _meet(lamps, lamp, origins, directions, distance, radiance, density):
    for k in range(len(lamp)):
        distance[k], light, density[k] = meet_lamp(lamps, lamp[k], row(origins, k), row(directions, k))
        put(radiance, k, light)


def lamp_hits(lights: Lights, lamp: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> LampHits:
    """Where rays with origins and unit directions (n, 3) meet lamps (n,); no ray meets a lamp without a size."""
    n, numbers = len(lamp), kernel_array(lamp, np.int32)
    hits = LampHits(np.empty(n, np.float32), np.empty((n, 3), np.float32), np.empty(n, np.float32))
    rays = kernel_array(origins, np.float32), kernel_array(directions, np.float32)
    _meet(lamp_arrays(lights), numbers, *rays, hits.distance, hits.radiance, hits.density)
    return hits


@kernel
def _look_along(lamps, origins, directions, distance, kind, objects, least_density, radiance):
    for k in range(len(distance)):
        origin, direction = row(origins, k), row(directions, k)
        of_ray = distance[k], kind[k], objects[k], least_density[k]
        put(radiance, k, radiance_of_lamps(lamps, origin, direction, *of_ray))


def lamps_along(
    lights: Lights,
    origins: np.ndarray,
    directions: np.ndarray,
    distance: np.ndarray,
    kind: np.ndarray,
    objects: np.ndarray,
    least_density: np.ndarray | None = None,
) -> np.ndarray:
    """Radiance of all lamps that rays meet, (n, 3) float32, W/(m² sr).

    Parameters
    ----------
    origins, directions : (n, 3) float32
    distance : (n,) float32, m
        To where surfaces end the rays.
    kind : (n,) of RayKind
        Lamps may be hidden from glossy and transmitted rays.
    objects : (n,) int
        That the rays start from, for lamps that do not light all.
    least_density : (n,) float32, 1/sr, optional
        Lamps whose `LampHits.density` is not below this are left out.
    """
    n = len(origins)
    radiance, least = np.empty((n, 3), np.float32), np.full(n, np.inf) if least_density is None else least_density
    rays = kernel_array(origins, np.float32), kernel_array(directions, np.float32), kernel_array(distance, np.float32)
    whose = kernel_array(kind, np.int64), kernel_array(objects, np.int64)
    _look_along(lamp_arrays(lights), *rays, *whose, kernel_array(least, np.float32), radiance)
    return radiance
