"""Links: the rays of vertices and of elements' sides, traced once; each is the side of an element that it ended on.

A link tells where light comes from and not how much, so that links stay while lamps and colours change. The k-th ray of
a row is the same whenever it is traced: the k-th point of a Sobol sequence, shifted by numbers of the row's own. Rays
that meet smooth gloss or glass are followed on to where they meet something matte.

An element is a mean, which those who are nearer than its size must not take: round an edge or on the lit side of a
shadow, parts that they do not see would shine into dark places. A ray that ends so near is followed on from there, and
the direct light of the near point is found apart.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ....bsdf.albedos import diffuse_albedo, glass_albedo, glossy_albedo, reflects_highlights, total_weight
from ....bsdf.closure import bsdf_at
from ....bsdf.mixture import NARROW_LOBES, TRANSLUCENT
from ....bsdf.scatter import axis_at, lambertian_normal, lit_normal, scatter
from ....core.compiling import by_reference, kernel, part, routine
from ....core.sampling.path_numbers import two_numbers
from ....core.sampling.warps import cosine_hemisphere
from ....core.vec3 import BLACK, ONE, WHITE, ZERO, dot, largest, mul, negative, plus, row, times, to_local, to_world
from ....gather.direct.ray_directions import shifted
from ....gather.direct.sampling import DirectArrays
from ....gather.direct.visible import arriving
from ....gather.radiance_cache.elements import ElementArrays, element_at
from ....gather.radiance_cache.hidden_sides import is_hidden
from ....gather.radiance_cache.lit_sides import point_of_side
from ....scene import RayKind
from ....scene.hit import hit_at, off_surface
from ....tracing.embree import Room
from ....tracing.transparency import Tracing, closest_hit
from .estimates import put_estimate
from .packing import packed

DARK, INSIDE = -1, -2
"""Ends of links that meet nothing that reflects, and of those that start inside of something: these do not count."""

FOLLOWED, NEAR = np.float32(-1), np.float32(-2)
"""Lengths of a link that was followed over smooth gloss or through glass, and of one that went on from a near point."""

BYTES = 13
"""That a link takes."""

N_PARTS = 4
"""Of a row's links: by their means its error is known, and the first alone makes the first light after an edit."""

KEPT, STALE, RENEWED, AGAIN = (np.uint8(state) for state in range(4))
"""States of a link: as it is; crossed by what an edit moved; traced again since; and crossed again after that."""

N_BEFORE = 64
"""Of a row's first links it is kept what they were before they were traced again."""

SHIFT, POINT, _FOLLOW = 1 << 15, (1 << 15) + 1, (1 << 15) + 3  # of a path's pairs of numbers
_MOST_STEPS, _MOST_NEAR, _NUMBERS_A_STEP = 8, 3, 32
_DIFFUSE, _GATHER, _PER_PI = int(RayKind.DIFFUSE), int(RayKind.GATHER), np.float32(1 / np.pi)


@by_reference
class LinkLight(NamedTuple):
    """What rays meet.

    Attributes
    ----------
    tracing : Tracing
    room : Room
        For one ray: each thread has its own.
    elements : ElementArrays
    hidden : (2 o,) or (0,) bool
        See `HiddenSides`.
    reach : (e,) float32, m
        Distance from which each element's mean is taken.
    direct : DirectArrays
        What gives light.
    caustics : (s, 3) or (0, 3) float32, W/(m² sr)
        E/π that mirrors and glass send onto sides, where there are any.
    """

    tracing: Tracing
    room: Room
    elements: ElementArrays
    hidden: np.ndarray
    reach: np.ndarray
    direct: DirectArrays
    caustics: np.ndarray


@by_reference
class LinkArrays(NamedTuple):
    """`Links` as kernels take them; see there."""

    end: np.ndarray
    length: np.ndarray
    weight: np.ndarray
    state: np.ndarray
    split: np.ndarray
    changed: np.ndarray
    end_before: np.ndarray
    weight_before: np.ndarray


@dataclass
class Links:
    """Up to n links of each of r rows.

    Attributes
    ----------
    arrays : LinkArrays
        end : (r, n) int32, side of an element (front 2k, back 2k + 1), `DARK` or `INSIDE`; length : (r, n) float32, m,
        of the first segment, infinite where it meets nothing, or `FOLLOWED` or `NEAR`; weight : (r, n) uint32, what
        surfaces on the way leave of the light, over the probability of the way, `packed`; state : (r, n) uint8;
        split : (r,) bool, whether some link of the row is not `KEPT`; changed : (r,) bool, whether one that was renewed
        since the edit is not what it was; end_before, weight_before : (r, m), what links that were traced again were
        before they were stale, of the first m.
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
    def n_first(self) -> int:
        """How many of each row make the first light after an edit."""
        return self.n_traced // N_PARTS

    @property
    def finished(self) -> bool:
        """Whether all are there, and none is stale."""
        return self.n_traced >= self.n_most and not self.stale

    @property
    def stale(self) -> bool:
        """Whether some may be."""
        return self.n_renewed < self.n_traced

    @staticmethod
    def none(n_rows: int, n: int) -> "Links":
        """Room for links, of which none is there yet."""
        end, length, weight = (np.zeros((n_rows, n), of) for of in (np.int32, np.float32, np.uint32))
        state, (split, changed) = np.zeros((n_rows, n), np.uint8), np.zeros((2, n_rows), np.bool_)
        before = (np.zeros((n_rows, min(n, N_BEFORE)), of) for of in (np.int32, np.uint32))
        return Links(LinkArrays(end, length, weight, state, split, changed, *before))

    def renewed_to(self, last: int) -> None:
        """Say how many of each row are not stale."""
        self.n_renewed = last
        if not self.stale:
            split = np.flatnonzero(self.arrays.split)
            self.arrays.state[split] = KEPT
            self.arrays.split[split] = False


@routine
def link_end(light, origin, direction, kind, key, path, lit):
    """Where a ray comes from something matte that is not too near, and the light of what is on the way.

    Parameters
    ----------
    light : LinkLight
    lit : bool
        Whether direct light at near points is wanted, too.

    Returns
    -------
    end, length, weight
        Of the link.
    near : triple, W/(m² sr)
        Radiance that near points make of direct light, if that is wanted.
    """
    tracing, room, elements = light.tracing, light.room, light.elements
    scene, weight, length, n_near, near = tracing.scene, WHITE, ZERO, 0, BLACK
    for step in range(_MOST_STEPS):
        triangle, distance, u, v, tint = closest_hit(tracing, room, origin, direction, kind)
        weight, length = mul(weight, tint), distance if step == 0 else NEAR if n_near > 0 else FOLLOWED
        if triangle < 0:
            return np.int32(DARK), length, weight, near
        hit = hit_at(scene, direction, triangle, distance, u, v)
        if step == 0 and len(light.hidden) > 0 and is_hidden(scene, light.hidden, triangle, hit.back):
            return np.int32(INSIDE), length, weight, near
        element, i = element_at(elements, triangle, u, v), _FOLLOW + step * _NUMBERS_A_STEP
        bsdf = bsdf_at(scene, hit, kind)
        wo = to_local(negative(direction), axis_at(scene, hit, direction))
        if scene.materials.directional[scene.material[triangle]]:
            chance, matte = _chances(scene, bsdf, wo)
            choice, follow = two_numbers(key, path, i)
            if follow < chance:
                a, b = two_numbers(key, path, i + 1)
                on = scatter(scene, hit, direction, choice, a, b, NARROW_LOBES, False, np.int64(kind))
                if not on.alive:
                    return np.int32(DARK), length, BLACK, near
                weight, kind = times(mul(weight, on.weight), ONE / chance), np.int64(on.kind)
                origin, direction = on.origin, on.direction
                continue
            weight = times(weight, ONE / (ONE - chance)) if matte else BLACK
        if n_near == _MOST_NEAR or distance >= light.reach[element] or not _only_reflects(scene, bsdf):
            return np.int32(2 * element + np.int32(hit.back)), length, weight, near
        # Too near for the element's mean: the point itself reflects, and a ray goes on from there
        n_near += 1
        weight, origin = mul(weight, matte_albedo(scene, bsdf, wo)), off_surface(scene, hit, ONE)
        if lit:
            at = origin, lit_normal(scene, hit), scene.object[triangle]
            _, one, _, met = arriving(light.direct, tracing, room, *at, key, path, i + 2, True)
            near = plus(near, mul(weight, times(plus(one, met), _PER_PI)))
            if len(light.caustics) > 0:
                near = plus(near, mul(weight, row(light.caustics, 2 * element + np.int32(hit.back))))
        a, b = two_numbers(key, path, i + 1)
        direction, kind = to_world(cosine_hemisphere(a, b), lambertian_normal(scene, hit)), np.int64(_DIFFUSE)
        if dot(direction, hit.normal) <= ZERO or largest(weight) <= ZERO:
            return np.int32(DARK), NEAR, BLACK, near
    return np.int32(DARK), NEAR if n_near > 0 else FOLLOWED, BLACK, near


@part
def _only_reflects(scene, bsdf):
    """Whether what a point sends on is what it reflects: nothing shines through it, or comes out of its body."""
    material = scene.material[bsdf.triangle]
    if scene.materials.subsurface[material]:
        return False
    return scene.materials.matte[material] or largest(total_weight(scene, bsdf, TRANSLUCENT)) <= ZERO


@part
def _chances(scene, bsdf, wo):
    """The chance that a ray is followed on from a surface, and whether that reflects otherwise at all."""
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
def trace_vertex_links(light, positions, normals, points, key, start, stop, first, last, stale, links):
    """Trace links `first` to `last` of vertices `start` to `stop`, or those of them that are stale."""
    for vertex in range(start, stop):
        if stale and not links.split[vertex]:
            continue
        for k in range(first, last):
            if stale and not is_stale(links, vertex, k):
                continue
            direction, path = vertex_ray(points, row(normals, vertex), key, vertex, k), vertex * len(points) + k
            end, far, weight, _ = link_end(light, row(positions, vertex), direction, _GATHER, key, path, False)
            _put_link(links, vertex, k, end, far, weight, stale)


@kernel
def trace_side_links(light, sides, points, key, start, stop, first, last, stale, links):
    """Trace links `first` to `last` of `sides` from `start` to `stop`, or those that are stale.

    From behind their facets comes nothing.
    """
    for i in range(start, stop):
        side = sides[i]
        if stale and not links.split[side]:
            continue
        for k in range(first, last):
            if stale and not is_stale(links, side, k):
                continue
            hit, origin, direction = side_ray(light.tracing.scene, light.elements, points, key, side, k)
            path = side * len(points) + k
            end, far, weight, _ = link_end(light, origin, direction, _DIFFUSE, key, path, False)
            if end != INSIDE and dot(direction, hit.normal) <= ZERO:
                end = np.int32(DARK)
            _put_link(links, side, k, end, far, weight, stale)


@kernel
def light_near_vertices(light, positions, normals, points, key, start, stop, first, last, links, of):
    """Make estimates `first` to `last` of what vertices `start` to `stop` get from near points in direct light."""
    for vertex in range(start, stop):
        for k in range(first, last):
            near = BLACK
            if links.length[vertex, k] == NEAR:
                direction, path = vertex_ray(points, row(normals, vertex), key, vertex, k), vertex * len(points) + k
                _, _, _, near = link_end(light, row(positions, vertex), direction, _GATHER, key, path, True)
            put_estimate(of, vertex, k, near, ONE)


@kernel
def light_near_sides(light, sides, points, key, start, stop, first, last, links, of):
    """The same of `sides` from `start` to `stop`; links that start inside of something do not count."""
    for i in range(start, stop):
        side = sides[i]
        for k in range(first, last):
            near, weight = BLACK, ZERO if links.end[side, k] == INSIDE else ONE
            if links.length[side, k] == NEAR:
                hit, origin, direction = side_ray(light.tracing.scene, light.elements, points, key, side, k)
                if dot(direction, hit.normal) > ZERO:
                    path = side * len(points) + k
                    _, _, _, near = link_end(light, origin, direction, _DIFFUSE, key, path, True)
            put_estimate(of, side, k, near, weight)


@part
def is_stale(links, i, k):
    """Whether a link is to be traced again."""
    return links.state[i, k] == STALE or links.state[i, k] == AGAIN


@part
def _put_link(links, i, k, end, far, weight, stale):
    """Write a link; of one that was stale see whether it is what it was."""
    if stale:
        same = end == links.end[i, k] and far == links.length[i, k] and packed(weight) == links.weight[i, k]
        links.changed[i] = links.changed[i] or not same
        if k < links.end_before.shape[1] and links.state[i, k] == STALE:
            links.end_before[i, k], links.weight_before[i, k] = links.end[i, k], links.weight[i, k]
        links.state[i, k] = RENEWED
    links.end[i, k], links.length[i, k], links.weight[i, k] = end, far, packed(weight)
