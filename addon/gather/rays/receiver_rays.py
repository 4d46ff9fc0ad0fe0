"""The rays of receivers: stratified directions around their normals, and sums of what these meet."""

from typing import NamedTuple

import numpy as np

from ...bsdf.frames import bump_shadowing
from ...core.compiling import by_reference, kernel
from ...core.sampling.path_numbers import two_numbers
from ...core.sampling.warps import cosine_hemisphere, cosine_uniform_mixture
from ...core.vec3 import BLACK, ONE, TWO, ZERO, dot, mul, plus, put, row, times, to_world
from ...scene import RayKind
from ..direct.ray_directions import shifted, stratified_set
from ..normal_gradient import gradient_of_light
from ..on_bodies import OnBodies, arrivals, turned_to
from ..radiance_cache.elements import element_at
from .gather_rays import GatherRays

_LEAST_DISTANCE = np.float32(1e-6)  # m
_HALF = np.float32(0.5)
_SHIFT = 1 << 15  # of a path's pairs of numbers, the one that shifts a batch's directions


@by_reference
class RaySums(NamedTuple):
    """What the rays of r receivers met, summed over batches; see `Records`.

    Attributes
    ----------
    total : (r, batches, 3 l) float64, W/(m² sr)
    nearness : (r,) float64, 1/m
    gradient : (r, 3, 3 l) float64, W/(m² sr)
        (r, 0, 3 l) where it is not asked for.
    """

    total: np.ndarray
    nearness: np.ndarray
    gradient: np.ndarray


def gather_at(
    rays: GatherRays,
    positions: np.ndarray,
    normals: np.ndarray,
    bases: np.ndarray,
    n_batches: int,
    n_rays: int,
    directional: bool,
    key: np.uint64,
    first: int,
    on: OnBodies | None = None,
) -> RaySums:
    """Send `n_rays` a batch from receivers (r, 3); cosine-weighted, or between that and uniform if `directional`.

    Light low above the horizon has a say in how irradiance changes with the normal: weighed by cosine-weighted rays it
    would have no finite variance.

    Parameters
    ----------
    bases : (r, 3) or (0, 3) float32
        Their `base_normal`, if they have any.
    key, first
        Of the random numbers, `path_key`, and the number of the first receiver.
    on : OnBodies, optional
        Where they lie on bodies through which the light walks to them; caustics that walk are among what they meet.
    """
    n, n_lights, first = len(positions), rays.n_lights, first * n_batches * n_rays
    origins, directions = np.empty((2, n * n_batches * n_rays, 3), np.float32)
    weights = np.empty(n * n_batches * n_rays if directional else 0, np.float32)
    points = stratified_set(n_rays)
    _start(positions, normals, n_batches, points, key, first, origins, directions, weights)
    if on is None:
        met = rays.radiance_of_paths(origins, directions, key, first, RayKind.GATHER)
    else:
        came = arrivals(rays.tracer, on, positions, normals, bases, n_batches * n_rays, key, first)
        turned, bases = np.empty_like(directions), bases[:0]
        _turn(rays.tracer.arrays.scene, came, normals, directions, origins, turned)
        met = rays.radiance_of_paths(origins, turned, key, first, RayKind.GATHER)
        for i, cache in enumerate(rays.caches):
            of_light = met.reflected[:, 3 * i : 3 * i + 3]
            _weigh(cache.elements, cache.incident_caustic, came, on.takes_caustics, of_light)
    total, nearness = np.zeros((n, n_batches, 3 * n_lights)), np.zeros(n)
    gradient = np.zeros((n, 3 if directional else 0, 3 * n_lights))
    _sum(normals, bases, directions, weights, met.reflected, met.hits.distance, total, nearness, gradient)
    return RaySums(total, nearness, gradient)


@kernel
def _start(positions, normals, n_batches, points, key, first, origins, directions, weights):
    """Rays of receivers, batch by batch; weights are 1/π over the density of their directions, if asked for."""
    n, ray = len(points), 0
    for receiver in range(len(positions)):
        position, normal = row(positions, receiver), row(normals, receiver)
        for _ in range(n_batches):
            a, b = two_numbers(key, first + ray, _SHIFT)
            for k in range(n):
                u, v = shifted(points, k, a, b)
                if len(weights) > 0:
                    x, y, z = cosine_uniform_mixture(u, v)
                    weights[ray] = TWO / (z + _HALF)  # the density is (cos θ + 1/2)/(2π)
                else:
                    x, y, z = cosine_hemisphere(u, v)
                put(origins, ray, position)
                put(directions, ray, to_world((x, y, z), normal))
                ray += 1


@kernel
def _turn(scene, came, normals, directions, origins, turned):
    """Start rays of receivers, around whose normals they lie, where their light arrives; bumps there take of it."""
    n = len(directions) // len(normals)
    for ray in range(len(directions)):
        normal, weight = row(came.normal, ray), row(came.weight, ray)
        direction = turned_to(row(directions, ray), row(normals, ray // n), normal)
        weight = times(weight, bump_shadowing(row(came.base, ray), normal, direction))
        triangle = came.triangle[ray]
        if triangle >= 0 and (dot(row(scene.normals, triangle), direction) < ZERO) != came.back[ray]:
            weight = BLACK
        put(came.weight, ray, weight)
        put(origins, ray, row(came.position, ray))
        put(turned, ray, direction)


@kernel
def _weigh(elements, caustic, came, takes_caustics, radiance):
    """Weigh what rays met, with the caustics added that come to bodies where the rays start."""
    n = len(radiance) // len(takes_caustics)
    for ray in range(len(radiance)):
        light, triangle = row(radiance, ray), came.triangle[ray]
        if triangle >= 0 and takes_caustics[ray // n]:
            side = 2 * element_at(elements, triangle, came.u[ray], came.v[ray]) + np.int32(came.back[ray])
            light = plus(light, row(caustic, side))
        put(radiance, ray, mul(row(came.weight, ray), light))


@kernel
def _sum(normals, bases, directions, weights, radiance, distance, total, nearness, gradient):
    """Sum what rays met over their batches and receivers; see `RaySums`."""
    n_batches, n_channels = total.shape[1], total.shape[2]
    n, ray = len(directions) // (len(total) * n_batches), 0
    for receiver in range(len(total)):
        for batch in range(n_batches):
            for _ in range(n):
                share = ONE
                if len(bases) > 0:
                    share = bump_shadowing(row(bases, receiver), row(normals, receiver), row(directions, ray))
                if len(weights) > 0:
                    direction, normal = row(directions, ray), row(normals, receiver)
                    g = times(gradient_of_light(direction, normal), share * weights[ray])
                    for channel in range(n_channels):
                        gradient[receiver, 0, channel] += g[0] * radiance[ray, channel]
                        gradient[receiver, 1, channel] += g[1] * radiance[ray, channel]
                        gradient[receiver, 2, channel] += g[2] * radiance[ray, channel]
                    share *= weights[ray] * dot(direction, normal)
                for channel in range(n_channels):
                    total[receiver, batch, channel] += share * radiance[ray, channel]
                nearness[receiver] += share / max(distance[ray], _LEAST_DISTANCE)
                ray += 1
