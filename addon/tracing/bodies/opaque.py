"""Bodies so thick that light leaves them about where it entered: for the light around them they are Lambertian.

In a medium far from its surface light falls off by e^(−s/ℓ) with ℓ = 1/√(3 σa σt'), the diffusion length, where σa is
the absorption and σt' the extinction of isotropic scattering alike. So the share of the light that comes out on other
parts of the surface is at most about the mean of e^(−s/ℓ), with s how far those are in directions by the cosine:
2 (ℓ/2r)² for a ball of radius r. Where that is below `SHARE` the closure becomes Lambertian, with the albedo that
walks in a half-space of the medium have: surfaces close to each other are then lit in all detail, and nothing walks.
"""

from dataclasses import replace

import numpy as np

from ...bsdf.phase import sampling as phase
from ...bsdf.subsurface.interface import enter
from ...bsdf.subsurface.medium import medium_at
from ...core.compiling import kernel, part, routine
from ...core.sampling.path_numbers import path_key, two_numbers
from ...core.sampling.vectors import rows
from ...core.sampling.warps import cosine_hemisphere
from ...core.vec3 import BLACK, ONE, ZERO, largest, mul, negative, row, to_world
from ...scene import Channel, Lobe, Scene
from ...scene.hit import hit_at, off_surface
from ..embree import BODIES, INFINITY, EmbreeTracer, intersect, new_ray
from .walk import MAX_STEPS, N_PAIRS, chances_of, coefficients, free_path, passed

SHARE = 0.01
"""Of the light that comes out elsewhere, at most, where a body is taken for Lambertian."""

_STREAM = 15  # of random numbers
_N_RAYS, _N_WALKS = 1 << 10, 1 << 14
_LEAST_ABSORBED, _THREE = np.float32(1e-5), np.float32(3)


def without_thick_bodies(scene: Scene, tracer: EmbreeTracer, seed: int) -> Scene:
    """The scene with Lambertian closures in place of subsurface scattering in bodies of which all are thick."""
    closures, albedo, thick = scene.materials.closures, np.ones((len(scene.materials.closures), 3), np.float32), []
    for k in np.flatnonzero(closures.kind == Lobe.SUBSURFACE):
        triangle = _triangles_of(scene, int(k))
        if _share_elsewhere(scene, tracer, int(k), triangle, seed) < SHARE:
            albedo[k] = _albedo_ratio(scene, int(k), triangle, seed)
            thick.append(k)
    if not thick:
        return scene
    kind = closures.kind.copy()
    kind[thick] = Lobe.DIFFUSE
    weight = Channel(closures.weight.value * albedo, closures.weight.texture)
    materials = replace(scene.materials, closures=replace(closures, kind=kind, weight=weight))
    return replace(scene, materials=materials)


def _triangles_of(scene: Scene, k: int) -> np.ndarray:
    """Triangles that have the k-th closure, each as often as its area says, (n,) int32."""
    seen = (scene.materials.seen_as == scene.materials.closures.material[k]).any(axis=1)
    of = np.flatnonzero(seen[scene.material_of_triangle]).astype(np.int32)
    if len(of) == 0:
        return of
    cumulative = np.cumsum(scene.areas[of])
    even = (np.arange(_N_RAYS) + 0.5) / _N_RAYS * cumulative[-1]
    return rows(of, np.minimum(np.searchsorted(cumulative, even), len(of) - 1))


def _share_elsewhere(scene: Scene, tracer: EmbreeTracer, k: int, triangle: np.ndarray, seed: int) -> float:
    """The mean of e^(−s/ℓ) over a closure's surface, of that side where it is more."""
    sums = np.zeros(2)
    _add_shares(scene.arrays, tracer.handles[BODIES], new_ray(), k, triangle, path_key(seed, _STREAM, 0), sums)
    return float(sums.max() / max(len(triangle), 1))


def _albedo_ratio(scene: Scene, k: int, triangle: np.ndarray, seed: int) -> np.ndarray:
    """Albedo of half-spaces of a closure's medium over its colour, the mean over its surface, (3,) float32."""
    total = np.zeros(3)
    if len(triangle):
        _add_half_space(scene.arrays, k, triangle, _N_WALKS, path_key(seed, _STREAM, 1), total)
    return (total / _N_WALKS).astype(np.float32)


@part
def _medium_on(scene, k, triangle, key, path, i):
    """The medium of a random point of a triangle, and the point's u and v."""
    u, v = two_numbers(key, path, i)
    if u + v > ONE:
        u, v = ONE - u, ONE - v
    return medium_at(scene, k, triangle, u, v), u, v


@part
def _diffusion_length(medium):
    """ℓ of the channel in which light comes farthest, m."""
    longest = ZERO
    for channel in range(3):
        extinction, albedo = medium.extinction[channel], medium.albedo[channel]
        absorbed, reduced = max(ONE - albedo, _LEAST_ABSORBED), ONE - albedo * medium.anisotropy
        longest = max(longest, ONE / (extinction * np.sqrt(_THREE * absorbed * reduced)))
    return longest


@kernel
def _add_shares(scene, tree, room, k, triangle, key, sums):
    """Add e^(−s/ℓ) of a ray into each triangle's front, and of one into its back, to two sums."""
    for i in range(len(triangle)):
        medium, u, v = _medium_on(scene, k, triangle[i], key, i, 0)
        a, b = two_numbers(key, i, 1)
        inwards = row(scene.normals, triangle[i])
        for side in range(2):
            inwards = negative(inwards)
            hit = hit_at(scene, inwards, triangle[i], ZERO, u, v)
            direction = to_world(negative(cosine_hemisphere(a, b)), hit.normal)
            _, distance, _, _ = intersect(tree, room, off_surface(scene, hit, -ONE), direction, INFINITY)
            sums[side] += np.exp(-distance / _diffusion_length(medium))


@kernel
def _add_half_space(scene, k, triangle, n, key, total):
    """Add to three sums what n walks bring out of half-spaces below z = 0, of views by the cosine."""
    for path in range(n):
        medium, _, _ = _medium_on(scene, k, triangle[path % len(triangle)], key, path, N_PAIRS)
        x, y = two_numbers(key, path, N_PAIRS + 1)
        u, v = two_numbers(key, path, N_PAIRS + 2)
        choice, _ = two_numbers(key, path, N_PAIRS + 3)
        inside = enter(medium, cosine_hemisphere(x, y), choice, u, v)
        if inside.weight > ZERO:
            left = _out_of_half_space(medium, inside.direction, key, path)
            for channel in range(3):
                total[channel] += left[channel]


@routine
def _out_of_half_space(medium, direction, key, path):
    """The weight of a walk that comes out at z = 0 again, as `walk` has it; black where it does not."""
    depth, weight = ZERO, medium.weight
    for step in range(MAX_STEPS):
        at = coefficients(medium, step)
        if step > 0:
            a, b = two_numbers(key, path, 3 * step)
            direction = phase.sample(direction, at.anisotropy, a, b)
        choice, number = two_numbers(key, path, 3 * step + 1)
        chances = chances_of(mul(weight, medium.albedo))
        distance = free_path(at, chances, choice, number)
        below = depth + distance * direction[2]
        if below >= ZERO:
            return mul(weight, passed(at, chances, -depth / direction[2], False))
        depth, weight = below, mul(weight, passed(at, chances, distance, True))
        if largest(weight) <= ZERO:
            break
    return BLACK
