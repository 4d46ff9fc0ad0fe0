"""How light travels between surfaces: past and through those that let it pass.

A surface of coverage c stops a ray with the probability c and lets it through otherwise, so that cut-out leaves stop
photons where they are opaque. Whether it does is drawn from the ray itself (a hash of its origin and direction), which
makes it the same whichever thread asks.
"""

from typing import NamedTuple

import numpy as np

from ..core.compiling import by_reference, part, routine
from ..core.vec3 import BLACK, ONE, WHITE, largest, length, minus, mul, times
from ..scene import RayKind
from ..scene.arrays import SceneArrays
from ..scene.hit import barycentrics, look_up, point_at
from .coplanar import (
    CoincidentArrays,
    brought_forward,
    following,
    is_absent,
    left_by_coincident,
    let_through,
    shares,
    viewed_from_back,
)
from .embree import INFINITY, SHORT_OF_TARGET, intersect, occluded
from .media.volumes import MediaArrays
from .onward import onward
from .ray_hash import hashed

_MAX_SURFACES = 64  # see-through surfaces along one ray
_SHADOW, _TINY = int(RayKind.SHADOW), np.float32(1e-30)


@by_reference
class Tracing(NamedTuple):
    """What kernels take to trace rays through a scene.

    Attributes
    ----------
    scene : SceneArrays
    trees : (6 or 7,) uint64
        Embree's tree that rays of each `RayKind` see, and that of `BODIES`.
    see_through : bool
        Whether some surface lets light through.
    coincident : CoincidentArrays
    all_objects : (o,) bool
        True: of `transmittance`, where all objects block.
    media : MediaArrays
        Between surfaces; who asks for surfaces alone asks nothing of them.
    """

    scene: SceneArrays
    trees: np.ndarray
    see_through: bool
    coincident: CoincidentArrays
    all_objects: np.ndarray
    media: MediaArrays


@part
def closest_hit(tracing, room, origin, direction, kind):
    """Where a ray is stopped: (triangle, distance, u, v, tint), with −1 for none.

    Surfaces are passed with the probability that they let light through; the tint is what they leave of it, and what
    surfaces do that lie in the place of the hit.
    """
    first = intersect(tracing.trees[kind], room, origin, direction, INFINITY)
    return stopped(tracing, room, origin, direction, kind, kind, False, first)


@part
def stopped(tracing, room, origin, direction, kind, seen, from_light, first):
    """Where a ray is stopped whose first hit (triangle, distance, u, v) is known; see `closest_hit`.

    Parameters
    ----------
    kind, seen : int
        `RayKind` of the objects that it meets, and of its view of surfaces: of a photon, that of those it flies to.
    from_light : bool
        Whether it is a photon.
    """
    tint, scene, materials = WHITE, tracing.scene, tracing.scene.materials
    kind, seen = np.int64(kind), np.int64(seen)  # for other types all parts would be compiled anew
    triangle, distance, u, v = first
    if tracing.see_through:
        met_first = triangle
        for step in range(_MAX_SURFACES):
            if triangle < 0 or not materials.see_through[scene.material[triangle]]:
                break
            stops, passes = shares(scene, triangle, u, v, direction, seen, from_light)
            if from_light:
                tint = times(tint, stops + passes)
            if hashed(origin, direction, step) * (stops + passes) < stops:
                break
            if not is_absent(scene, triangle, direction):
                back = viewed_from_back(scene, triangle, direction, from_light)
                tint = mul(tint, look_up(scene, materials.tint, triangle, u, v, back, seen))
            met = triangle, distance, u, v
            triangle, distance, u, v, met_first = _after(tracing, room, direction, INFINITY, kind, met, met_first)
    if tracing.coincident.any and triangle >= 0 and tracing.coincident.shares[triangle]:
        triangle, u, v = brought_forward(tracing, kind, triangle, u, v)
        tint = mul(tint, left_by_coincident(tracing, triangle, u, v, direction, seen, from_light))
    return triangle, distance, u, v, tint


@part
def beyond(tracing, room, direction, kind, seen, passed):
    """Where a photon is stopped after it passed a surface (triangle, distance, u, v) that stops others."""
    origin = point_at(tracing.scene, passed[0], passed[2], passed[3])
    first = onward(tracing.scene, tracing.trees[kind], room, direction, INFINITY, passed, passed[0])
    return stopped(tracing, room, origin, direction, kind, seen, True, first)


@part
def visibility(tracing, room, origin, target):
    """Share of the light that passes from one point to another; the last 1e-4 of the way is not looked at."""
    way = minus(target, origin)
    distance = length(way)
    direction, far = times(way, ONE / max(distance, _TINY)), distance * SHORT_OF_TARGET
    if not occluded(tracing.trees[_SHADOW], room, origin, direction, far):
        return WHITE
    if not tracing.see_through:
        return BLACK
    return transmittance(tracing, room, origin, direction, far, tracing.all_objects, _SHADOW, False)


@part
def transmittance(tracing, room, origin, direction, far, blocks, seen, from_light):
    """What surfaces that cast shadows leave of light as far as `far`, of objects (o,) that block; see `let_through`."""
    scene, passes = tracing.scene, WHITE
    triangle, distance, u, v = intersect(tracing.trees[_SHADOW], room, origin, direction, far)
    first = triangle
    for _ in range(_MAX_SURFACES):
        if triangle < 0:
            return passes
        if blocks[scene.object[triangle]]:
            passes = mul(passes, let_through(scene, triangle, u, v, direction, seen, from_light))
            if largest(passes) <= 0:
                return BLACK
        met = triangle, distance, u, v
        triangle, distance, u, v, first = _after(tracing, room, direction, far, _SHADOW, met, first)
    return BLACK


@routine
def _after(tracing, room, direction, far, kind, passed, first):
    """The surface that a ray meets after the one that it passed: another in the same place, else one beyond.

    Parameters
    ----------
    first : int32
        Triangle that the ray met first of those in the place passed; returned anew for the hit, at the end.
    """
    scene, (triangle, distance, u, v) = tracing.scene, passed
    if tracing.coincident.any and tracing.coincident.shares[triangle]:
        other = following(tracing, kind, triangle, u, v, first)
        if other >= 0:
            u, v = barycentrics(scene, other, point_at(scene, triangle, u, v))
            return other, distance, u, v, first
    triangle, distance, u, v = onward(scene, tracing.trees[kind], room, direction, far, passed, first)
    return triangle, distance, u, v, triangle
