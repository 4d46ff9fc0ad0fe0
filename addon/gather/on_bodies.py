"""Receivers on bodies with subsurface scattering: the light on them is what a view of them finds that walks through.

As Cycles bakes it, a surface viewed along its normal has of a diffuse closure the light that comes to it, and of a
subsurface closure that which comes to where the view's walk leaves the body (`bsdf.subsurface`), each by its share of
the colour: with weights w, Σ w E / Σ w, where E is E(x), or E[W E(y)].

An `Arrival` says for one ray of a receiver which of the two it is for, and where it starts.
"""

from typing import NamedTuple

import numpy as np

from ..bsdf.albedos import diffuse_albedo
from ..bsdf.closure import bsdf_at
from ..bsdf.mixture import SUBSURFACE, choose_closure, transmittance_to
from ..bsdf.scatter import axis_at
from ..core.compiling import by_reference, kernel, kernel_array, part, routine
from ..core.sampling.path_numbers import two_numbers
from ..core.vec3 import BLACK, ONE, WHITE, ZERO, mean, minus, mul, negative, plus, put, row, times, to_local, to_world
from ..receivers import Receivers
from ..scene import RayKind, Scene
from ..scene.hit import channel_at, hit_at, off_surface, shading_normal
from ..tracing import EmbreeTracer, TransparencyTracer
from ..tracing.bodies.through import body_normal, outside_of, seen_walk, walk_key
from ..tracing.bodies.walk import N_PAIRS
from ..tracing.embree import new_ray

_NEAR = 0.5
"""How far below a receiver its surface is, at most, of the radius that it stands for."""

_TINY = np.float32(1e-6)
_CAMERA, _SUBSURFACE_LOBE = int(RayKind.CAMERA), 1 << SUBSURFACE
_WALK = 1 << 10  # of the keys of a path's walks, beyond those of surfaces


@by_reference
class OnBodies(NamedTuple):
    """Where n receivers lie on bodies.

    Attributes
    ----------
    triangle : (n,) int32
        −1 of those that are on none.
    u, v : (n,) float32
    back : (n,) bool
    takes_caustics : (n,) bool
        As that of `Receivers`.
    """

    triangle: np.ndarray
    u: np.ndarray
    v: np.ndarray
    back: np.ndarray
    takes_caustics: np.ndarray

    @staticmethod
    def of(scene: Scene, tracer: EmbreeTracer, receivers: Receivers) -> "OnBodies | None":
        """The surfaces below receivers, of those materials through which light walks; None where all are on others."""
        if not scene.materials.subsurface.any() or len(receivers) == 0:
            return None
        down = -(receivers.normal if receivers.base_normal is None else receivers.base_normal)
        hits = tracer.closest_hit(receivers.position, down)
        walks = scene.materials.subsurface[scene.material_of_triangle[np.maximum(hits.triangle, 0)]]
        on = (hits.triangle >= 0) & walks & (hits.distance <= _NEAR * receivers.footprint)
        if not on.any():
            return None
        takes = np.ones(len(on), bool) if receivers.takes_caustics is None else receivers.takes_caustics
        return OnBodies(np.where(on, hits.triangle, np.int32(-1)), hits.u, hits.v, hits.back(down), takes)

    @property
    def there(self) -> np.ndarray:
        """Which receivers are on one, (n,) bool."""
        return self.triangle >= 0

    def where(self, chosen: np.ndarray | slice) -> "OnBodies":
        """Those of some receivers."""
        return OnBodies(*(np.ascontiguousarray(of[chosen]) for of in self))


@by_reference
class Arrivals(NamedTuple):
    """Where the light comes to that n receivers get by m rays each, (n m, …).

    Attributes
    ----------
    position, normal, base : (r, 3) float32
        As those of `Receivers`.
    weight : (r, 3) float32
        What the light counts for; 1 for receivers on no body.
    triangle, u, v, back : (r,)
        The surface there; −1 of receivers on no body.
    """

    position: np.ndarray
    normal: np.ndarray
    base: np.ndarray
    weight: np.ndarray
    triangle: np.ndarray
    u: np.ndarray
    v: np.ndarray
    back: np.ndarray

    def turned(self, directions: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Directions (r, 3) from receivers' normals (r, 3), as far from those where the light arrives, float32."""
        result = np.empty((len(directions), 3), np.float32)
        at = kernel_array(directions, np.float32), kernel_array(normals, np.float32)
        _turn(*at, self.normal, result)
        return result


def arrivals(
    tracer: TransparencyTracer,
    on: OnBodies,
    positions: np.ndarray,
    normals: np.ndarray,
    bases: np.ndarray,
    n_rays: int,
    key: np.uint64,
    first: int,
) -> Arrivals:
    """Arrivals of some rays of each receiver (n, 3).

    Parameters
    ----------
    bases : (n, 3) or (0, 3) float32
        Their `base_normal`, if they have any.
    key, first
        Of the random numbers (`path_key`), and the number of the first ray.
    """
    n = len(positions) * n_rays
    (position, normal, base, weight), (u, v) = np.empty((4, n, 3), np.float32), np.empty((2, n), np.float32)
    found = Arrivals(position, normal, base, weight, np.empty(n, np.int32), u, v, np.empty(n, np.bool_))
    at = positions, normals, bases if len(bases) else normals
    _arrive(tracer.arrays, new_ray(), on, *at, n_rays, key, first, found)
    return found


@kernel
def _arrive(tracing, room, on, positions, normals, bases, n_rays, key, first, found):
    scene = tracing.scene
    for ray in range(len(found.triangle)):
        i = ray // n_rays
        position, normal, base, weight = row(positions, i), row(normals, i), row(bases, i), WHITE
        triangle, u, v, back = np.int32(-1), ZERO, ZERO, False
        if on.triangle[i] >= 0:
            hit = _hit_of(scene, on, i)
            walked, weight, out, onward = _arrival(tracing, room, hit, key, first + ray)
            triangle, u, v, back = out.triangle, out.u, out.v, out.back
            if walked:
                position, base = off_surface(scene, out, ONE), shading_normal(scene, out)
                normal = body_normal(scene, out, _CAMERA, onward)
        put(found.position, ray, position)
        put(found.normal, ray, normal)
        put(found.base, ray, base)
        put(found.weight, ray, weight)
        found.triangle[ray], found.u[ray], found.v[ray], found.back[ray] = triangle, u, v, back


@kernel
def _turn(directions, normals, others, result):
    for k in range(len(result)):
        put(result, k, turned_to(row(directions, k), row(normals, k), row(others, k)))


@part
def turned_to(direction, normal, other):
    """A direction as far from another normal as it was from the first."""
    return to_world(to_local(direction, normal), other)


@part
def _hit_of(scene, on, i):
    """The surface below the i-th receiver, seen from there."""
    triangle = on.triangle[i]
    towards = row(scene.normals, triangle)
    if not on.back[i]:
        towards = negative(towards)
    return hit_at(scene, towards, triangle, ZERO, on.u[i], on.v[i])


@routine
def _arrival(tracing, room, hit, key, path):
    """Where light comes to that a view along the normal sees at a hit: by a walk or not, its weight, a `Hit`, and the
    direction in which the walk leaves the body.
    """
    scene, numbers = tracing.scene, walk_key(key, _WALK)
    shading = shading_normal(scene, hit)
    bsdf, axis = bsdf_at(scene, hit, _CAMERA), axis_at(scene, hit, negative(shading))
    wo = to_local(shading, axis)
    share = _shares(scene, bsdf, wo)
    chance = mean(share)
    choice, u = two_numbers(numbers, path, N_PAIRS)
    if choice >= chance:
        return False, times(minus(WHITE, share), ONE / max(ONE - chance, _TINY)), hit, shading
    v, other = two_numbers(numbers, path, N_PAIRS + 1)
    k, inverse, _ = choose_closure(scene, bsdf, wo, choice / chance, _SUBSURFACE_LOBE, False)
    exit_ = seen_walk(tracing, room, hit, bsdf, k, axis, wo, other, u, v, numbers, path)
    if not exit_.found:
        return True, BLACK, hit, shading
    weight = _over(_scattered(scene, bsdf, k, wo), diffuse_albedo(scene, bsdf, wo))
    weight = times(mul(weight, exit_.weight), inverse / chance)
    return True, weight, outside_of(scene, exit_), exit_.direction


@part
def _shares(scene, bsdf, wo):
    """Of what broad and Lambertian closures reflect, the share of those through which light walks."""
    total = BLACK
    for k in range(bsdf.first, bsdf.last):
        if scene.materials.closures.kind[k] == SUBSURFACE:
            total = plus(total, _scattered(scene, bsdf, k, wo))
    return _over(total, diffuse_albedo(scene, bsdf, wo))


@part
def _scattered(scene, bsdf, k, wo):
    """The weight of a point's k-th closure, with what layers leave of it."""
    weight = channel_at(scene, scene.materials.closures.weight, k, bsdf.triangle, bsdf.u, bsdf.v)
    return mul(weight, transmittance_to(scene, bsdf, k, wo))


@part
def _over(a, b):
    """a/b, 0 where b is."""
    return (
        a[0] / b[0] if b[0] > ZERO else ZERO,
        a[1] / b[1] if b[1] > ZERO else ZERO,
        a[2] / b[2] if b[2] > ZERO else ZERO,
    )
