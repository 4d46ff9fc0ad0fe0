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
from .coplanar import (
    CoincidentArrays,
    brought_forward,
    coplanar_occluded,
    following,
    is_absent,
    left_by_coincident,
    let_through,
    shares,
    viewed_from_back,
)
from .embree import INFINITY, SHORT_OF_TARGET, EmbreeTracer, intersect, new_ray, occluded
from .onward import onward
from .protocol import Hits, Tracer
from .ray_hash import hashed

_MAX_SURFACES = 64  # see-through surfaces along one ray
_SHADOW, _DIFFUSE = int(RayKind.SHADOW), int(RayKind.DIFFUSE)
_TINY, _NO_TINT = np.float32(1e-30), np.empty((0, 3), np.float32)


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
def _closest_hits(tracing, room, origins, directions, kind, seen, from_light, hits):
    for i in range(len(origins)):
        origin, direction = row(origins, i), row(directions, i)
        first = intersect(tracing.trees[kind[i]], room, origin, direction, INFINITY)
        stop = stopped(tracing, room, origin, direction, kind[i], seen[i], from_light, first)
        _write(tracing, hits, i, stop)


@kernel
def _stops(tracing, room, origins, directions, kind, seen, from_light, hits):
    for i in range(len(origins)):
        first = hits[0][i], hits[1][i], hits[2][i], hits[3][i]
        stop = stopped(tracing, room, row(origins, i), row(directions, i), kind[i], seen[i], from_light, first)
        _write(tracing, hits, i, stop)


@kernel
def _beyond(tracing, room, directions, seen, hits):
    for i in range(len(directions)):
        passed = hits[0][i], hits[1][i], hits[2][i], hits[3][i]
        _write(tracing, hits, i, beyond(tracing, room, row(directions, i), _DIFFUSE, seen[i], passed))


@kernel
def _visibilities(tracing, room, origins, targets, passes):
    for i in range(len(origins)):
        put(passes, i, visibility(tracing, room, row(origins, i), row(targets, i)))


@kernel
def _transmittances(tracing, room, origins, directions, far, blocks, passes):
    for i in range(len(origins)):
        share = transmittance(tracing, room, row(origins, i), row(directions, i), far[i], blocks, _SHADOW, True)
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
        return Tracing(
            scene, self.surfaces.handles, see_through, self._coincident.arrays, np.ones(len(scene.emits), bool)
        )

    def closest_hit(
        self,
        origins: np.ndarray,
        directions: np.ndarray,
        kind: np.ndarray | RayKind = RayKind.DIFFUSE,
        photons_to: np.ndarray | None = None,
    ) -> Hits:
        """Where each ray (n, 3) is stopped.

        Parameters
        ----------
        kind : RayKind or (n,) of it
        photons_to : (n,) uint8, optional
            Of photons: the `RayKind` of those who see what they meet.
        """
        kinds, from_light = np.full(len(origins), kind, np.uint8), photons_to is not None
        seen = kinds if photons_to is None else photons_to
        rays = kernel_array(origins, np.float32), kernel_array(directions, np.float32), kinds
        hits = self._empty_hits(len(origins))
        if self._first_hits is None:
            _closest_hits(self.arrays, new_ray(), *rays, seen, from_light, _columns(hits))
        else:
            for one in np.unique(kinds):
                k = np.flatnonzero(kinds == one)
                hits.put(k, self._first_hits.closest_hit(origins[k], directions[k], kind=RayKind(one)))
            _stops(self.arrays, new_ray(), *rays, seen, from_light, _columns(hits))
        return hits

    def beyond(self, directions: np.ndarray, photons_to: np.ndarray, passed: Hits) -> Hits:
        """Where photons are stopped after they passed surfaces that stop others, with the whole distance."""
        hits = self._empty_hits(len(directions))
        hits.put(np.arange(len(directions)), replace(passed, tint=None))
        _beyond(self.arrays, new_ray(), kernel_array(directions, np.float32), photons_to, _columns(hits))
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
        _visibilities(
            self.arrays, new_ray(), kernel_array(origins, np.float32), kernel_array(targets, np.float32), passes
        )
        return passes

    def transmittance(
        self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray, blocks: np.ndarray | None = None
    ) -> np.ndarray:
        """What surfaces that cast shadows leave of each photon as far as `t_max` (n,), (n, 3) float32.

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


def _columns(hits: Hits) -> tuple[np.ndarray, ...]:
    """What kernels write of hits; the tint is empty where there is none."""
    return hits.triangle, hits.distance, hits.u, hits.v, hits.normal, _NO_TINT if hits.tint is None else hits.tint
