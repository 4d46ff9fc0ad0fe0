"""Links: the rays of vertices and of elements' sides, traced once; each is the side of an element that it ended on.

A link tells where light comes from and not how much, so that links stay while lamps and colours change. The k-th ray of
a row is the same whenever it is traced: the k-th point of a Sobol sequence, shifted by numbers of the row's own. Rays
that meet smooth gloss or glass are followed on to where they meet something matte.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ....bsdf.albedos import diffuse_albedo, glass_albedo, glossy_albedo, reflects_highlights, total_weight
from ....bsdf.closure import bsdf_at
from ....bsdf.mixture import NARROW_LOBES, TRANSLUCENT
from ....bsdf.scatter import axis_at, lambertian_normal, scatter
from ....core.compiling import by_reference, kernel, part
from ....core.sampling.path_numbers import two_numbers
from ....core.sampling.warps import cosine_hemisphere
from ....core.vec3 import BLACK, ONE, WHITE, ZERO, dot, largest, mul, negative, put, row, times, to_local, to_world
from ....gather.direct.ray_directions import shifted
from ....gather.radiance_cache.elements import element_at
from ....gather.radiance_cache.hidden_sides import is_hidden
from ....gather.radiance_cache.lit_sides import point_of_side
from ....scene import RayKind
from ....scene.hit import hit_at, off_surface
from ....tracing.transparency import closest_hit

DARK, INSIDE = -1, -2
"""Ends of links that meet nothing that reflects, and of those that start inside of something: these do not count."""

FOLLOWED = np.float32(-1)
"""Length of a link that was followed over smooth gloss or through glass."""

KEPT, STALE, RENEWED = np.uint8(0), np.uint8(1), np.uint8(2)
"""States of a link: as it is; crossed by what an edit moved; traced again since."""

SHIFT, POINT, _FOLLOW = 1 << 15, (1 << 15) + 1, (1 << 15) + 3  # of a path's pairs of numbers
_MOST_FOLLOWED, _NUMBERS_A_STEP = 8, 3
_DIFFUSE, _GATHER = int(RayKind.DIFFUSE), int(RayKind.GATHER)


@by_reference
class LinkArrays(NamedTuple):
    """`Links` as kernels take them; see there."""

    end: np.ndarray
    length: np.ndarray
    weight: np.ndarray
    state: np.ndarray
    split: np.ndarray


@dataclass
class Links:
    """Up to n links of each of r rows.

    Attributes
    ----------
    arrays : LinkArrays
        end : (r, n) int32, side of an element (front 2k, back 2k + 1), `DARK` or `INSIDE`; length : (r, n) float32, m,
        of the first segment, infinite where it meets nothing, or `FOLLOWED`; weight : (r, n, 3) or (r, 0, 3) float32,
        what surfaces on the way leave of the light, over the probability of the way: without it, all of it;
        state : (r, n) uint8; split : (r,) bool, whether some link of the row is not `KEPT`.
    n_traced : int
        So many links of each row are there.
    n_renewed : int
        So many of them are not stale any more.
    """

    arrays: LinkArrays
    n_traced: int = 0
    n_renewed: int = 0

    @property
    def end(self) -> np.ndarray:
        """Sides that the links end on, (r, n) int32."""
        return self.arrays.end

    @property
    def n_most(self) -> int:
        return self.arrays.end.shape[1]

    @property
    def finished(self) -> bool:
        """Whether all are there, and none is stale."""
        return self.n_traced >= self.n_most and not self.stale

    @property
    def stale(self) -> bool:
        """Whether some may be."""
        return self.n_renewed < self.n_traced

    @staticmethod
    def none(n_rows: int, n: int, weighted: bool) -> "Links":
        """Room for links, of which none is there yet."""
        length, weight = np.zeros((n_rows, n), np.float32), np.zeros((n_rows, n if weighted else 0, 3), np.float32)
        end, state = np.full((n_rows, n), DARK, np.int32), np.zeros((n_rows, n), np.uint8)
        return Links(LinkArrays(end, length, weight, state, np.zeros(n_rows, np.bool_)))

    def renewed_to(self, last: int) -> None:
        """Say how many of each row are not stale."""
        self.n_renewed = last
        if not self.stale:
            split = np.flatnonzero(self.arrays.split)
            self.arrays.state[split] = KEPT
            self.arrays.split[split] = False


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
    a, b = two_numbers(key, vertex, SHIFT)
    u, v = shifted(points, k, a, b)
    return to_world(cosine_hemisphere(u, v), normal)


@part
def side_ray(scene, elements, points, key, side, k):
    """The k-th point of a side as a `Hit`, and the origin and direction of the ray from there."""
    hit = point_of_side(scene, elements, side, key, side * len(points) + k, POINT)
    a, b = two_numbers(key, side * len(points), SHIFT)
    u, v = shifted(points, k, a, b)
    return hit, off_surface(scene, hit, ONE), to_world(cosine_hemisphere(u, v), lambertian_normal(scene, hit))


@kernel
def trace_vertex_links(
    tracing, room, elements, hidden, positions, normals, points, key, start, stop, first, last, stale, links
):
    """Trace links `first` to `last` of vertices `start` to `stop`, or those of them that are stale."""
    for vertex in range(start, stop):
        if stale and not links.split[vertex]:
            continue
        for k in range(first, last):
            if stale and links.state[vertex, k] != STALE:
                continue
            direction, path = vertex_ray(points, row(normals, vertex), key, vertex, k), vertex * len(points) + k
            origin = row(positions, vertex)
            side, far, light = link_end(tracing, room, elements, hidden, origin, direction, _GATHER, key, path)
            _put_link(links, vertex, k, side, far, light, stale)


@kernel
def trace_side_links(tracing, room, elements, hidden, sides, points, key, start, stop, first, last, stale, links):
    """Trace links `first` to `last` of `sides` from `start` to `stop`, or those that are stale.

    From behind their facets comes nothing.
    """
    for i in range(start, stop):
        side = sides[i]
        if stale and not links.split[side]:
            continue
        for k in range(first, last):
            if stale and links.state[side, k] != STALE:
                continue
            hit, origin, direction = side_ray(tracing.scene, elements, points, key, side, k)
            path = side * len(points) + k
            met, far, light = link_end(tracing, room, elements, hidden, origin, direction, _DIFFUSE, key, path)
            if met != INSIDE and dot(direction, hit.normal) <= ZERO:
                met = np.int32(DARK)
            _put_link(links, side, k, met, far, light, stale)


@part
def _put_link(links, i, k, side, far, light, stale):
    links.end[i, k], links.length[i, k] = side, far
    if links.weight.shape[1] > 0:
        put(links.weight[i], k, light)
    if stale:
        links.state[i, k] = RENEWED
