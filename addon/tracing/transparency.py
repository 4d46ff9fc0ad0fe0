"""How light travels between surfaces: past and through those that let it pass.

A surface of coverage c stops a ray with the probability c and lets it through otherwise, so that cut-out leaves stop
photons where they are opaque. Whether it does is drawn from the ray itself (a hash of its origin and direction), which
makes it the same whichever thread asks.
"""

from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..core.compiling import by_reference, kernel, kernel_array, part, routine
from ..core.progress import Progress
from ..core.vec3 import BLACK, ONE, WHITE, largest, length, minus, mul, put, row, times
from ..scene import RayKind, Scene
from ..scene.arrays import SceneArrays
from ..scene.hit import barycentrics, hit_at, look_up, point_at
from .coincident import CoincidentSurfaces
from .coplanar import CoincidentArrays, brought_forward, coplanar_occluded, following, left_by_coincident, let_through
from .embree import INFINITY, SHORT_OF_TARGET, EmbreeTracer, intersect, new_ray, occluded
from .onward import onward
from .protocol import Hits, Tracer

_MAX_SURFACES = 64  # see-through surfaces along one ray
_SHADOW, _DIFFUSE = int(RayKind.SHADOW), int(RayKind.DIFFUSE)
_MIX_1, _MIX_2, _LOW = np.uint64(0x7FEB352D), np.uint64(0x846CA68B), np.uint64(0xFFFFFFFF)
_STEP, _8, _15, _16 = np.uint64(0x9E3779B9), np.uint64(8), np.uint64(15), np.uint64(16)
_TINY = np.float32(1e-30)


@by_reference
class Tracing(NamedTuple):
    """What kernels take to trace rays through a scene.

    Attributes
    ----------
    scene : SceneArrays
    trees : (5,) uint64
        Embree's tree that rays of each `RayKind` see.
    see_through : bool
        Whether some surface lets light through.
    coincident : CoincidentArrays
    all_objects : (o,) bool
        True: of `transmittance`, where all objects block.
    """

    scene: SceneArrays
    trees: np.ndarray
    see_through: bool
    coincident: CoincidentArrays
    all_objects: np.ndarray


@part
def closest_hit(tracing, room, origin, direction, kind):
    """Where a ray is stopped: (triangle, distance, u, v, tint), with −1 for none.

    Surfaces are passed with the probability that they let light through; the tint is what they leave of it, and what
    surfaces do that lie in the place of the hit.
    """
    triangle, distance, u, v = intersect(tracing.trees[kind], room, origin, direction, INFINITY)
    return stopped(tracing, room, origin, direction, kind, triangle, distance, u, v)


@part
def stopped(tracing, room, origin, direction, kind, triangle, distance, u, v):
    """Where a ray is stopped whose first hit is known; see `closest_hit`."""
    tint, scene, materials = WHITE, tracing.scene, tracing.scene.materials
    kind = np.int64(kind)  # for other types all parts would be compiled anew
    if tracing.see_through:
        first = triangle
        for step in range(_MAX_SURFACES):
            if triangle < 0 or not materials.see_through[scene.material[triangle]]:
                break
            coverage = look_up(scene, materials.coverage, triangle, u, v)[0]
            if _hashed(origin, direction, step) < coverage:
                break
            tint = mul(tint, look_up(scene, materials.tint, triangle, u, v))
            met = triangle, distance, u, v
            triangle, distance, u, v, first = _after(tracing, room, direction, INFINITY, kind, met, first)
    if tracing.coincident.any and triangle >= 0 and tracing.coincident.shares[triangle]:
        triangle, u, v = brought_forward(tracing, kind, triangle, u, v)
        tint = mul(tint, left_by_coincident(tracing, triangle, u, v))
    return triangle, distance, u, v, tint


@part
def beyond(tracing, room, direction, kind, passed):
    """Where a ray is stopped after it passed a surface (triangle, distance, u, v) that stops others."""
    origin = point_at(tracing.scene, passed[0], passed[2], passed[3])
    first = onward(tracing.scene, tracing.trees[kind], room, direction, INFINITY, passed, passed[0])
    return stopped(tracing, room, origin, direction, kind, *first)


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
    return transmittance(tracing, room, origin, direction, far, tracing.all_objects)


@routine
def transmittance(tracing, room, origin, direction, far, blocks):
    """What surfaces that cast shadows leave of the light along a ray as far as `far`; of objects (o,) that block."""
    scene, passes = tracing.scene, WHITE
    triangle, distance, u, v = intersect(tracing.trees[_SHADOW], room, origin, direction, far)
    first = triangle
    for _ in range(_MAX_SURFACES):
        if triangle < 0:
            return passes
        if blocks[scene.object[triangle]]:
            passes = mul(passes, let_through(scene, triangle, u, v))
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


@part
def _hashed(origin, direction, step):
    """A number in [0, 1) of a ray and a step, by the mixing of Wellons' "Hash Function Prospector"."""
    mixed = (np.uint64(step + 1) * _STEP) & _LOW
    for value in origin:
        mixed = _mixed(mixed, value)
    for value in direction:
        mixed = _mixed(mixed, value)
    return np.float32(mixed >> _8) * np.float32(2**-24)


@part
def _mixed(mixed, value):
    """The low 32 bits of a number, mixed with those of a float32."""
    mixed ^= np.uint64(np.float32(value).view(np.uint32))
    mixed = ((mixed ^ (mixed >> _16)) * _MIX_1) & _LOW
    mixed = ((mixed ^ (mixed >> _15)) * _MIX_2) & _LOW
    return mixed ^ (mixed >> _16)


@part
def _write(tracing, hits, i, stop):
    """Write where a ray is stopped (`closest_hit`) into the i-th of `Hits`."""
    triangle, distance, u, v, normal, tint = hits
    triangle[i], distance[i], u[i], v[i], color = stop
    if stop[0] >= 0:
        put(normal, i, row(tracing.scene.normals, stop[0]))
    if len(tint):
        put(tint, i, color)


@kernel
def _closest_hits(tracing, room, origins, directions, kind, hits):
    for i in range(len(origins)):
        stop = closest_hit(tracing, room, row(origins, i), row(directions, i), kind[i])
        _write(tracing, hits, i, stop)


@kernel
def _stops(tracing, room, origins, directions, kind, hits):
    for i in range(len(origins)):
        first = hits[0][i], hits[1][i], hits[2][i], hits[3][i]
        stop = stopped(tracing, room, row(origins, i), row(directions, i), kind[i], *first)
        _write(tracing, hits, i, stop)


@kernel
def _beyond(tracing, room, directions, hits):
    for i in range(len(directions)):
        passed = hits[0][i], hits[1][i], hits[2][i], hits[3][i]
        _write(tracing, hits, i, beyond(tracing, room, row(directions, i), _DIFFUSE, passed))


@kernel
def _visibilities(tracing, room, origins, targets, passes):
    for i in range(len(origins)):
        put(passes, i, visibility(tracing, room, row(origins, i), row(targets, i)))


@kernel
def _transmittances(tracing, room, origins, directions, far, blocks, passes):
    for i in range(len(origins)):
        share = transmittance(tracing, room, row(origins, i), row(directions, i), far[i], blocks)
        put(passes, i, share)


@kernel
def _coplanar_occluded(tracing, triangle, u, v, result):
    for i in range(len(triangle)):
        result[i] = False
        if triangle[i] >= 0:
            hit = hit_at(tracing.scene, BLACK, triangle[i], INFINITY, u[i], v[i])  # whatever the direction
            result[i] = coplanar_occluded(tracing, hit)


class TransparencyTracer:
    """Traces light in a scene with see-through and coincident surfaces: arrays of rays, by the parts above.

    Parameters
    ----------
    scene : Scene
    tracer : EmbreeTracer
    progress : Progress, optional
        Of the search for surfaces in one place.

    Attributes
    ----------
    surfaces : EmbreeTracer
        `tracer`: where any surface is, see-through or not.
    """

    def __init__(self, scene: Scene, tracer: EmbreeTracer, progress: Progress | None = None) -> None:
        self._scene, self.surfaces = scene, tracer
        self._coincident = CoincidentSurfaces(scene, tracer, progress or Progress())
        self._first_hits: Tracer | None = None

    def with_first_hits(self, tracer: Tracer) -> "TransparencyTracer":
        """The same, but `closest_hit` takes the first surfaces along rays from another tracer."""
        other = copy(self)
        other._first_hits = tracer
        return other

    def lit_by(self, scene: Scene) -> "TransparencyTracer":
        """The same for the same surfaces, lit by other lights (`Scene.lit_by`)."""
        other = copy(self)
        other._scene = scene
        other.__dict__["arrays"] = self.arrays._replace(scene=scene.arrays)
        return other

    @cached_property
    def arrays(self) -> Tracing:
        """What kernels take; valid as long as this tracer lives."""
        scene = self._scene.arrays
        see_through = bool(scene.materials.see_through[scene.material].any())
        all_objects = np.ones(len(scene.emits), bool)
        return Tracing(scene, self.surfaces.handles, see_through, self._coincident.arrays, all_objects)

    def closest_hit(
        self, origins: np.ndarray, directions: np.ndarray, kind: np.ndarray | RayKind = RayKind.DIFFUSE
    ) -> Hits:
        """Where each ray (n, 3) is stopped; `kind` is one for all or (n,) of `RayKind`."""
        kinds = np.full(len(origins), kind, np.uint8)
        rays = kernel_array(origins, np.float32), kernel_array(directions, np.float32), kinds
        hits = self._empty_hits(len(origins))
        if self._first_hits is None:
            _closest_hits(self.arrays, new_ray(), *rays, _columns(hits))
        else:
            for one in np.unique(kinds):
                k = np.flatnonzero(kinds == one)
                hits.put(k, self._first_hits.closest_hit(origins[k], directions[k], kind=RayKind(one)))
            _stops(self.arrays, new_ray(), *rays, _columns(hits))
        return hits

    def beyond(self, directions: np.ndarray, passed: Hits) -> Hits:
        """Where diffuse rays are stopped after they passed surfaces that stop others, with the whole distance."""
        hits = self._empty_hits(len(directions))
        hits.put(np.arange(len(directions)), replace(passed, tint=None))
        _beyond(self.arrays, new_ray(), kernel_array(directions, np.float32), _columns(hits))
        return hits

    def _empty_hits(self, n: int) -> Hits:
        """Hits to be written, with a tint only if there may be one."""
        tints = self.arrays.see_through or self.arrays.coincident.any
        distance, u, v = np.empty((3, n), np.float32)
        tint = np.empty((n, 3), np.float32) if tints else None
        return Hits(np.empty(n, np.int32), distance, u, v, np.zeros((n, 3), np.float32), tint)

    @property
    def flush_emitters(self) -> list[tuple[str, str]]:
        """Names of emissive objects, and of those whose place they share."""
        names = self._scene.objects.names
        return list(dict.fromkeys((names[one], names[other]) for one, other in self._coincident.flush_emitters))

    def coplanar_occluded(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Whether an opaque surface lies where points of triangles are, so that no light leaves them, (n,) bool."""
        result = np.empty(len(triangle), bool)
        places = kernel_array(triangle, np.int32), kernel_array(u, np.float32), kernel_array(v, np.float32)
        _coplanar_occluded(self.arrays, *places, result)
        return result

    def visibility(self, origins: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """Share of the light that passes from each origin to its target, (n, 3) float32."""
        passes = np.empty((len(origins), 3), np.float32)
        ends = kernel_array(origins, np.float32), kernel_array(targets, np.float32)
        _visibilities(self.arrays, new_ray(), *ends, passes)
        return passes

    def transmittance(
        self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray, blocks: np.ndarray | None = None
    ) -> np.ndarray:
        """What surfaces that cast shadows leave of the light along each ray as far as `t_max` (n,), (n, 3) float32.

        Parameters
        ----------
        blocks : (o,) bool, optional
            Objects that count; all without it.
        """
        passes = np.empty((len(origins), 3), np.float32)
        rays = kernel_array(origins, np.float32), kernel_array(directions, np.float32)
        blocks = self.arrays.all_objects if blocks is None else kernel_array(blocks, np.bool_)
        _transmittances(self.arrays, new_ray(), *rays, kernel_array(t_max, np.float32), blocks, passes)
        return passes


_NO_TINT = np.empty((0, 3), np.float32)


def _columns(hits: Hits) -> tuple[np.ndarray, ...]:
    """What kernels write of hits; the tint is empty where there is none."""
    return hits.triangle, hits.distance, hits.u, hits.v, hits.normal, _NO_TINT if hits.tint is None else hits.tint
