"""What becomes of light where surfaces lie in one place (`coincident`), inside kernels.

`tracing` is `Tracing`: of its `coincident` arrays each triangle has partners that share some of its points.
"""

from typing import NamedTuple

import numpy as np

from ..core.compiling import by_reference, part, routine
from ..core.vec3 import BLACK, ONE, WHITE, ZERO, dot, largest, minus, mul, row, times, wide
from ..scene import RayKind
from ..scene.hit import barycentrics, corners, is_back, look_up, plane_coordinates, point_at
from .ray_hash import hashed

_DIFFUSE_RAY = int(RayKind.DIFFUSE)
_HALF = np.float32(0.5)
ONE_PLACE = 2.0**-21
"""How far apart surfaces may be, over their coordinates: about what float32 cannot tell apart."""


@by_reference
class CoincidentArrays(NamedTuple):
    """Surfaces in one place.

    Attributes
    ----------
    any : bool
    shares : (t,) bool
        Which triangles have partners: one byte is sooner there than two of `start`.
    start : (t + 1,) int64
        Where the partners of each triangle start.
    partner : (p,) int32
    low, high : (p, 3) float32, m
        Bounds of the partners, and a little more.
    in_front : (t,) bool
        What emits and is opaque has nothing in front.
    hidden : (t,) bool
        What shares its place with something in front.
    """

    any: bool
    shares: np.ndarray
    start: np.ndarray
    partner: np.ndarray
    low: np.ndarray
    high: np.ndarray
    in_front: np.ndarray
    hidden: np.ndarray


@routine
def brought_forward(tracing, kind, triangle, u, v):
    """The place (triangle, u, v) of a hit, moved to what emits if that lies there, too, and rays of the kind see it."""
    scene, coincident = tracing.scene, tracing.coincident
    if not coincident.hidden[triangle]:
        return triangle, u, v
    x = point_at(scene, triangle, u, v)
    for k in range(coincident.start[triangle], coincident.start[triangle + 1]):
        partner = coincident.partner[k]
        emits = coincident.in_front[partner] and scene.seen_by[kind, scene.object[partner]]
        if emits and _lies_there(tracing, k, x, triangle):
            u, v = barycentrics(scene, partner, x)
            return partner, u, v
    return triangle, u, v


@part
def coplanar_occluded(tracing, hit):
    """Whether an opaque surface lies where a `Hit` is, and in front of it, so that no light leaves it.

    See-through surfaces occlude nothing: `left_by_coincident` says what they do.
    """
    scene, coincident = tracing.scene, tracing.coincident
    if not (coincident.any and coincident.shares[hit.triangle]):
        return False
    for k in range(coincident.start[hit.triangle], coincident.start[hit.triangle + 1]):
        opaque = not scene.materials.see_through[scene.material[coincident.partner[k]]]
        if opaque and _lies_there(tracing, k, hit.position, hit.triangle):
            return not _rounded_to_front(scene, hit.triangle, hit.position)
    return False


@routine
def left_by_coincident(tracing, triangle, u, v, direction, seen, from_light):
    """Share of light that passes the other surfaces where a ray meets a point of a triangle; see `let_through`."""
    scene, coincident = tracing.scene, tracing.coincident
    x, passes = point_at(scene, triangle, u, v), WHITE
    for k in range(coincident.start[triangle], coincident.start[triangle + 1]):
        if _lies_there(tracing, k, x, triangle):
            partner = coincident.partner[k]
            if not scene.materials.see_through[scene.material[partner]] and _rounded_to_front(scene, triangle, x):
                continue
            u, v = barycentrics(scene, partner, x)
            passes = mul(passes, let_through(scene, partner, u, v, direction, seen, from_light))
    return passes


@routine
def following(tracing, kind, triangle, u, v, first):
    """The triangle in the same place that comes after one, in the order of their numbers, round to that which a ray
    met `first`; −1 after the last, and where rays of the kind see no other.
    """
    scene, coincident = tracing.scene, tracing.coincident
    n = np.int64(len(scene.triangles))
    turns = n if first == triangle else (np.int64(first) - np.int64(triangle)) % n
    x = point_at(scene, triangle, u, v)
    for k in range(coincident.start[triangle], coincident.start[triangle + 1]):
        partner = coincident.partner[k]
        after = (np.int64(partner) - np.int64(triangle)) % n
        if after < turns and scene.seen_by[kind, scene.object[partner]] and _lies_there(tracing, k, x, triangle):
            turns = after
    met = (np.int64(triangle) + turns) % n
    return np.int32(met) if met != first else np.int32(-1)


@routine
def let_through(scene, triangle, u, v, direction, seen, from_light):
    """Share of light that passes straight through a point of a triangle along a ray, as the kind of rays `seen` has it.

    With `from_light` the ray is a photon's.
    """
    if is_absent(scene, triangle, direction):
        return WHITE
    materials, back = scene.materials, viewed_from_back(scene, triangle, direction, from_light)
    coverage = look_up(scene, materials.coverage, triangle, u, v, back, seen)[0]
    return times(look_up(scene, materials.tint, triangle, u, v, back, seen), ONE - coverage)


@part
def shares(scene, triangle, u, v, direction, seen, from_light):
    """Shares of a ray that a see-through surface stops and lets pass.

    Together they are 1, but for a photon where the surface differs by view: what it stops those see who are on the
    photon's side, by diffuse rays, and what it lets pass those to whom the photon flies.
    """
    if is_absent(scene, triangle, direction):
        return ZERO, ONE
    coverage, back = scene.materials.coverage, is_back(scene, triangle, direction)
    viewed = look_up(scene, coverage, triangle, u, v, back != from_light, seen)[0]
    if not from_light or viewed >= ONE:
        return viewed, ONE - viewed
    return look_up(scene, coverage, triangle, u, v, back, _DIFFUSE_RAY)[0], ONE - viewed


@part
def is_absent(scene, triangle, direction):
    """Whether a ray comes to the back of a surface that has none."""
    return scene.materials.one_sided[scene.material[triangle]] and is_back(scene, triangle, direction)


@part
def viewed_from_back(scene, triangle, direction, from_light):
    """Whether those who see by a ray see a triangle's back: of a photon, those to whom it flies."""
    return is_back(scene, triangle, direction) != from_light


@part
def _rounded_to_front(scene, triangle, x):
    """Whether float32 rounds a point of a triangle to the front of the other surfaces in its place.

    Across an axis positions have no error, and rays from one surface meet the other at once. In other planes the error
    has either sign by chance, which is drawn from the point itself: half of the points are in front.
    """
    a, b, c = corners(scene, triangle)
    for i in range(3):
        if a[i] == b[i] and b[i] == c[i]:
            return False
    return hashed(x, BLACK, 0) < _HALF


@part
def _lies_there(tracing, k, x, own):
    """Whether a point of the triangle `own` lies on the k-th partner. Of the many that a ground has, few are near."""
    low, high = tracing.coincident.low, tracing.coincident.high
    near = (low[k, 0] <= x[0] <= high[k, 0]) and (low[k, 1] <= x[1] <= high[k, 1]) and (low[k, 2] <= x[2] <= high[k, 2])
    return near and lies_on(tracing.scene, tracing.coincident.partner[k], x, own)


@part
def lies_on(scene, triangle, x, own):
    """Whether a point of the triangle `own` lies on another."""
    a = row(scene.vertices, scene.triangles[triangle, 0])
    height = abs(dot(minus(wide(x), wide(a)), wide(row(scene.normals, triangle))))
    # Points and normals are rounded by the size of the corners that they come from
    size = max(_extent(scene, triangle), _extent(scene, own))
    if height > ONE_PLACE * np.float64(_size(x)) + ONE_PLACE / 2 * np.float64(size):
        return False
    u, v = plane_coordinates(scene, triangle, x)
    return u >= 0.0 and v >= 0.0 and u + v <= 1.0


@part
def _extent(scene, triangle):
    """The largest size of a triangle's coordinates."""
    a, b, c = corners(scene, triangle)
    return max(_size(a), max(_size(b), _size(c)))


@part
def _size(a):
    return largest((abs(a[0]), abs(a[1]), abs(a[2])))
