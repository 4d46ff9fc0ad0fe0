"""The tracer of a scene with see-through and coincident surfaces: arrays of rays, by the parts of `transparency`."""

from copy import copy
from dataclasses import replace
from functools import cached_property

import numpy as np

from ..core.compiling import kernel, kernel_array, part
from ..core.progress import Progress
from ..core.vec3 import BLACK, put, row
from ..scene import RayKind, Scene
from ..scene.hit import hit_at
from .coincident import CoincidentSurfaces
from .coplanar import coplanar_occluded
from .embree import INFINITY, EmbreeTracer, intersect, new_ray
from .media.flight import media_left
from .media.volumes import MediaVolumes
from .protocol import Hits, Tracer
from .transparency import Tracing, beyond, stopped, transmittance, visibility

_SHADOW, _DIFFUSE = int(RayKind.SHADOW), int(RayKind.DIFFUSE)
_NO_TINT = np.empty((0, 3), np.float32)


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
def _media_left(tracing, room, origins, directions, far, passes):
    for i in range(len(origins)):
        put(passes, i, media_left(tracing, room, row(origins, i), row(directions, i), far[i]))


@kernel
def _coplanar_occluded(tracing, triangle, u, v, result):
    for i in range(len(triangle)):
        result[i] = False
        if triangle[i] >= 0:
            hit = hit_at(tracing.scene, BLACK, triangle[i], INFINITY, u[i], v[i])  # whatever the direction
            result[i] = coplanar_occluded(tracing, hit)


class TransparencyTracer:
    """Traces light in a scene with see-through and coincident surfaces: arrays of rays.

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
        self._media = MediaVolumes(scene)
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
            scene,
            self.surfaces.handles,
            see_through,
            self._coincident.arrays,
            np.ones(len(scene.emits), bool),
            self._media.arrays,
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

    def dimmed(self, hits: Hits, origins: np.ndarray, directions: np.ndarray) -> Hits:
        """The hits of rays (n, 3), whose tint is what media leave, too, of the light that shines there."""
        if not self.arrays.media.any:
            return hits
        return replace(hits, tint=hits.tinted(self.media_left(origins, directions, hits.distance)))

    def media_left(self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray) -> np.ndarray:
        """What media leave of light along rays as far as `t_max` (n,), (n, 3) float32."""
        passes = np.empty((len(origins), 3), np.float32)
        rays = kernel_array(origins, np.float32), kernel_array(directions, np.float32), kernel_array(t_max, np.float32)
        _media_left(self.arrays, new_ray(), *rays, passes)
        return passes


def _columns(hits: Hits) -> tuple[np.ndarray, ...]:
    """What kernels write of hits; the tint is empty where there is none."""
    return hits.triangle, hits.distance, hits.u, hits.v, hits.normal, _NO_TINT if hits.tint is None else hits.tint
