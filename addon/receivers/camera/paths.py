"""Samples followed from the camera over mirrors and clear glass, and the light that they meet there."""

from dataclasses import dataclass

import numpy as np

from ...bsdf.albedos import is_mirror
from ...bsdf.closure import bsdf_at
from ...bsdf.mixture import GLASS, NARROW_LOBES
from ...bsdf.scatter import scatter, scatter_both_ways
from ...core.compiling import kernel, part
from ...core.sampling.path_numbers import two_numbers
from ...core.sampling.vectors import rows
from ...core.vec3 import BLACK, ONE, ZERO, add, dot, mean, mul, plus, put, row
from ...emitters.lamps import lamp_arrays, radiance_of_lamps
from ...emitters.mesh import lights_up
from ...emitters.world import world_arrays, world_seen
from ...scene import RayKind, Scene
from ...scene.hit import emitted, hit_at, is_back
from ...tracing import Hits, TransparencyTracer
from ...tracing.embree import new_ray
from ...tracing.media.flight import media_left
from ...tracing.transparency import closest_hit

_MOST_FOLLOWED = 8
"""Mirrors and surfaces of glass that a sample is followed over: through four bodies of glass."""

_MOST_SPLIT = 2
"""Surfaces of glass, the first ones, at which a sample goes both ways: through one body, and what it mirrors inside."""

_N_BRANCHES = 1 << _MOST_SPLIT
_GLOSSY_RAY, _TRANSMITTED_RAY, _CAMERA_RAY = int(RayKind.GLOSSY), int(RayKind.TRANSMITTED), int(RayKind.CAMERA)
_TINY, _INFINITY = np.float32(1e-20), np.float32(np.inf)


@dataclass(frozen=True)
class FollowedPaths:
    """Where n samples end on surfaces, in their order; those that glass splits in several places, all there is of each.

    Attributes
    ----------
    sample : (k,) int64
    hits : Hits
    directions : (k, 3) float32
    throughput, share, n_followed
        As in `CameraSamples`.
    distance : (k,) float32, m
        Of all the way.
    beyond : (n, 3) float32, W/(m² sr)
        What each sample meets of emission and lamps over more than one mirror or surface of glass.
    """

    sample: np.ndarray
    hits: Hits
    directions: np.ndarray
    throughput: np.ndarray
    share: np.ndarray
    distance: np.ndarray
    n_followed: np.ndarray
    beyond: np.ndarray


def followed_paths(
    scene: Scene, tracer: TransparencyTracer, hits: Hits, directions: np.ndarray, throughput: np.ndarray, key: np.uint64
) -> FollowedPaths:
    """Send those of n samples on that met a mirror or clear glass, until they meet something else; a few are dropped.

    Parameters
    ----------
    hits : Hits
        What the samples meet first, along directions (n, 3).
    throughput : (n, 3) float32
        What is left of the light on its way back.
    key : uint64
        Of the random numbers.
    """
    n = len(directions)
    most, beyond = _N_BRANCHES * n, np.zeros((n, 3), np.float32)
    sample, triangle, n_followed = np.empty(most, np.int64), np.empty(most, np.int32), np.empty(most, np.uint8)
    (u, v, distance, share), (onward, left) = np.empty((4, most), np.float32), np.empty((2, most, 3), np.float32)
    met = directions, hits.triangle, hits.distance, hits.u, hits.v, throughput
    ends = sample, triangle, u, v, onward, left, share, distance, n_followed, beyond
    lights = lamp_arrays(scene.lights), world_arrays(scene.world)
    k = slice(_follow(tracer.arrays, new_ray(), *lights, key, *met, *ends))
    on = Hits(triangle[k], distance[k], u[k], v[k], rows(scene.normals, triangle[k]))
    return FollowedPaths(sample[k], on, onward[k], left[k], share[k], distance[k], n_followed[k], beyond)


@kernel
def _follow(
    tracing, room, lamps, world, key,
    direction, triangle, distance, u, v, throughput,
    sample, end_triangle, end_u, end_v, end_direction, end_throughput, share, way, n_followed, beyond,
):  # fmt: skip
    """Follow samples to all of their ends; returns how many there are on surfaces."""
    n = 0
    for path in range(len(triangle)):
        for branch in range(_N_BRANCHES):
            met = triangle[path], distance[path], u[path], v[path]
            at = row(direction, path), met, row(throughput, path)
            end, light, n_splits = _branch(tracing, room, lamps, world, key, path, branch, *at)
            if branch >> n_splits == 0:
                add(beyond, path, light)
                if end[0] >= 0:
                    sample[n], end_triangle[n], end_u[n], end_v[n] = path, end[0], end[1], end[2]
                    share[n], way[n], n_followed[n] = end[5], end[6], end[7]
                    put(end_direction, n, end[3])
                    put(end_throughput, n, end[4])
                    n += 1
            if n_splits == 0:
                break
    return n


@part
def _branch(tracing, room, lamps, world, key, path, branch, direction, met, throughput):
    """One way of a sample: bit k of `branch` says whether it is reflected where glass splits it for the k-th time.

    Returns
    -------
    end : (triangle, u, v, direction, throughput, share, way, n_followed)
        Triangle −1 where it comes to no surface.
    light : triple
        What it meets over more than one mirror or surface of glass.
    n_splits : int
    """
    scene, (triangle, way, u, v) = tracing.scene, met
    share, light, n_splits, n_followed, kind = ONE, BLACK, 0, 0, _CAMERA_RAY
    for step in range(_MOST_FOLLOWED + 1):
        if triangle < 0:
            break
        hit = hit_at(scene, direction, triangle, way, u, v)
        bsdf = bsdf_at(scene, hit, kind)
        if not is_mirror(scene, bsdf):
            break
        # The numbers are those of other branches as long as the way is theirs
        i = 2 * (_N_BRANCHES * step + (branch & ((1 << n_splits) - 1)))
        choice, _ = two_numbers(key, path, i)
        a, b = two_numbers(key, path, i + 1)
        if step < _MOST_SPLIT and _is_glass(scene, bsdf):
            on, other = scatter_both_ways(scene, hit, direction, choice, a, b, kind)
            if branch >> n_splits & 1 == 0:
                on, other = other, on
            share *= mean(on.weight) / max(mean(on.weight) + mean(other.weight), _TINY)
            n_splits += 1
        else:
            on = scatter(scene, hit, direction, choice, a, b, NARROW_LOBES, False, kind)
        if step == _MOST_FOLLOWED or not on.alive:
            triangle, throughput = np.int32(-1), BLACK
            break
        kind = _GLOSSY_RAY if dot(on.direction, hit.normal) > ZERO else _TRANSMITTED_RAY
        triangle, distance, u, v, tint = closest_hit(tracing, room, on.origin, on.direction, kind)
        direction, throughput = on.direction, mul(throughput, mul(on.weight, tint))
        if tracing.media.any:
            throughput = mul(throughput, media_left(tracing, room, on.origin, direction, distance))
        if step > 0:
            object_ = scene.object[hit.triangle]
            met_lamps = radiance_of_lamps(lamps, on.origin, direction, distance, kind, object_, _INFINITY)
            light = plus(light, mul(throughput, met_lamps))
        if triangle >= 0:
            way += distance
        n_followed += 1
    if n_followed > 1:
        if triangle < 0:
            shining = world_seen(world, direction, kind)
        else:
            lit = lights_up(scene, scene.object[triangle], scene.object[hit.triangle])
            shining = emitted(scene, triangle, u, v, is_back(scene, triangle, direction), kind) if lit else BLACK
        light = plus(light, mul(throughput, shining))
    return (triangle, u, v, direction, throughput, share, way, n_followed), light, n_splits


@part
def _is_glass(scene, bsdf):
    """Whether a surface is of nothing but glass."""
    n_others = 0
    for k in range(bsdf.first, bsdf.last):
        n_others += scene.materials.closures.kind[k] != GLASS
    return n_others == 0
