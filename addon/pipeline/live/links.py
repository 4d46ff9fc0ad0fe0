"""Links: the rays of vertices and of elements' sides, traced once; each is the side of an element that it ended on.

A link tells where light comes from and not how much, so that links stay while lamps and colours change. The k-th ray of
a row is the same whenever it is traced: the k-th point of a Sobol sequence, shifted by numbers of the row's own. Rays
that meet smooth gloss or glass are followed on to where they meet something matte.
"""

from dataclasses import dataclass

import numpy as np

from ...bsdf.albedos import diffuse_albedo, glass_albedo, glossy_albedo, reflects_highlights, total_weight
from ...bsdf.closure import bsdf_at
from ...bsdf.mixture import NARROW_LOBES, TRANSLUCENT
from ...bsdf.scatter import axis_at, lambertian_normal, scatter
from ...core.compiling import kernel, part
from ...core.sampling.path_numbers import two_numbers
from ...core.sampling.warps import cosine_hemisphere
from ...core.vec3 import BLACK, ONE, WHITE, ZERO, dot, largest, mul, negative, put, row, times, to_local, to_world
from ...gather.direct.ray_directions import shifted
from ...gather.radiance_cache.elements import element_at
from ...gather.radiance_cache.hidden_sides import is_hidden
from ...gather.radiance_cache.lit_sides import point_of_side
from ...scene import RayKind
from ...scene.hit import hit_at, off_surface
from ...tracing.transparency import closest_hit

DARK, INSIDE = -1, -2
"""Ends of links that meet nothing that reflects, and of those that start inside of something: these do not count."""

FOLLOWED = np.float32(-1)
"""Length of a link that was followed over smooth gloss or through glass."""

_SHIFT, _POINT, _FOLLOW = 1 << 15, (1 << 15) + 1, (1 << 15) + 3  # of a path's pairs of numbers
_MOST_FOLLOWED, _NUMBERS_A_STEP = 8, 3
_DIFFUSE, _GATHER = int(RayKind.DIFFUSE), int(RayKind.GATHER)


@dataclass
class Links:
    """Up to n links of each of r rows.

    Attributes
    ----------
    end : (r, n) int32
        Side of an element (front 2k, back 2k + 1), `DARK` or `INSIDE`.
    length : (r, n) float32, m
        Of the first segment; infinite where it meets nothing, or `FOLLOWED`.
    weight : (r, n, 3) or (r, 0, 3) float32
        What surfaces on the way leave of the light, over the probability of the way; without it, all of it.
    n_traced : int
        So many links of each row are there.
    """

    end: np.ndarray
    length: np.ndarray
    weight: np.ndarray
    n_traced: int = 0

    @property
    def finished(self) -> bool:
        """Whether all are there."""
        return self.n_traced >= self.end.shape[1]

    @staticmethod
    def none(n_rows: int, n: int, weighted: bool) -> "Links":
        """Room for links, of which none is there yet."""
        length, weight = np.zeros((n_rows, n), np.float32), np.zeros((n_rows, n if weighted else 0, 3), np.float32)
        return Links(np.full((n_rows, n), DARK, np.int32), length, weight)


@part
def link_end(tracing, room, elements, hidden, origin, direction, kind, key, path):
    """Where a ray comes from something matte: end, length and weight of its link."""
    scene, weight, length = tracing.scene, WHITE, ZERO
    for step in range(_MOST_FOLLOWED):
        triangle, distance, u, v, tint = closest_hit(tracing, room, origin, direction, kind)
        weight, length = mul(weight, tint), distance if step == 0 else FOLLOWED
        if triangle < 0:
            return np.int32(DARK), length, weight
        hit = hit_at(scene, direction, triangle, distance, u, v)
        if step == 0 and len(hidden) > 0 and is_hidden(scene, hidden, triangle, hit.back):
            return np.int32(INSIDE), length, weight
        side = np.int32(2 * element_at(elements, triangle, u, v) + np.int32(hit.back))
        if not scene.materials.directional[scene.material[triangle]]:
            return side, length, weight
        i = _FOLLOW + step * _NUMBERS_A_STEP
        chance, matte = _chances(scene, hit, direction, kind)
        choice, follow = two_numbers(key, path, i)
        if follow >= chance:
            return (side if matte else np.int32(DARK)), length, times(weight, ONE / (ONE - chance))
        a, b = two_numbers(key, path, i + 1)
        on = scatter(scene, hit, direction, choice, a, b, NARROW_LOBES, False, np.int64(kind))
        if not on.alive:
            return np.int32(DARK), length, BLACK
        weight, origin, direction, kind = times(mul(weight, on.weight), ONE / chance), on.origin, on.direction, on.kind
    return np.int32(DARK), FOLLOWED, BLACK


@part
def _chances(scene, hit, direction, kind):
    """The chance that a ray is followed on from a surface, and whether that reflects otherwise at all."""
    bsdf = bsdf_at(scene, hit, kind)
    wo = to_local(negative(direction), axis_at(scene, hit, direction))
    followed, matte = largest(glass_albedo(scene, bsdf)), largest(matte_albedo(scene, bsdf, wo))
    if not reflects_highlights(scene, bsdf):
        followed += largest(glossy_albedo(scene, bsdf, wo))
    matte += largest(total_weight(scene, bsdf, TRANSLUCENT))
    return followed / max(followed + matte, np.float32(1e-20)), matte > ZERO


@part
def matte_albedo(scene, bsdf, wo):
    """What a surface reflects that elements answer for, seen from wo: rough gloss is taken for matte."""
    albedo = diffuse_albedo(scene, bsdf, wo)
    if reflects_highlights(scene, bsdf):
        gloss = glossy_albedo(scene, bsdf, wo)
        albedo = albedo[0] + gloss[0], albedo[1] + gloss[1], albedo[2] + gloss[2]
    return albedo


@part
def vertex_ray(points, normal, key, vertex, k):
    """Direction of the k-th ray of a vertex."""
    a, b = two_numbers(key, vertex, _SHIFT)
    u, v = shifted(points, k, a, b)
    return to_world(cosine_hemisphere(u, v), normal)


@part
def side_ray(scene, elements, points, key, side, k):
    """The k-th point of a side as a `Hit`, and the origin and direction of the ray from there."""
    hit = point_of_side(scene, elements, side, key, side * len(points) + k, _POINT)
    a, b = two_numbers(key, side * len(points), _SHIFT)
    u, v = shifted(points, k, a, b)
    return hit, off_surface(scene, hit, ONE), to_world(cosine_hemisphere(u, v), lambertian_normal(scene, hit))


@kernel
def trace_vertex_links(
    tracing, room, elements, hidden, positions, normals, points, key, start, stop, first, last, end, length, weight
):
    """Trace links `first` to `last` of vertices `start` to `stop`."""
    for vertex in range(start, stop):
        for k in range(first, last):
            direction, path = vertex_ray(points, row(normals, vertex), key, vertex, k), vertex * len(points) + k
            origin = row(positions, vertex)
            side, far, light = link_end(tracing, room, elements, hidden, origin, direction, _GATHER, key, path)
            _put_link(end, length, weight, vertex, k, side, far, light)


@kernel
def trace_side_links(
    tracing, room, elements, hidden, sides, points, key, start, stop, first, last, end, length, weight
):
    """Trace links `first` to `last` of `sides` from `start` to `stop`; from behind their facets comes nothing."""
    for i in range(start, stop):
        side = sides[i]
        for k in range(first, last):
            hit, origin, direction = side_ray(tracing.scene, elements, points, key, side, k)
            path = side * len(points) + k
            met, far, light = link_end(tracing, room, elements, hidden, origin, direction, _DIFFUSE, key, path)
            if met != INSIDE and dot(direction, hit.normal) <= ZERO:
                met = np.int32(DARK)
            _put_link(end, length, weight, side, k, met, far, light)


@part
def _put_link(end, length, weight, i, k, side, far, light):
    end[i, k], length[i, k] = side, far
    if weight.shape[1] > 0:
        put(weight[i], k, light)
