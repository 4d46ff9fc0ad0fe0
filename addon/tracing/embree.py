"""Rays traced by Embree: the parts that kernels call for one ray, and the tracer looped from them."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..core.compiling import by_reference, kernel, kernel_array, part
from ..core.sampling.vectors import rows
from ..core.vec3 import ZERO, length, minus, row, times
from ..scene import RayKind, Scene
from .embree_library import EmbreeTree, TreeOfTrees, rtc_intersect, rtc_occluded
from .protocol import Hits, tree_of_each_kind

BODIES = len(RayKind)
"""Of the trees, after those of each `RayKind`: that of objects in which light walks, whatever sees them."""

SHORT_OF_TARGET = np.float32(1 - 1e-4)
INFINITY = np.float32(np.inf)
_NONE, _ALL = np.int32(-1), np.int32(-1)
_TINY = np.float32(1e-30)
_RAY_FLOATS, _ALIGNED = 24, 64  # of an RTCRayHit; bytes


@by_reference
class Room(NamedTuple):
    """Memory for one ray and its hit (RTCRayHit), as floats, as integers and by its address. Each call of a kernel
    brings its own, so that threads share none.
    """

    floats: np.ndarray
    integers: np.ndarray
    address: int


def new_ray() -> Room:
    """Room for one ray."""
    memory = np.zeros(4 * _RAY_FLOATS + _ALIGNED, np.uint8)
    start = -memory.ctypes.data % _ALIGNED
    floats = memory[start : start + 4 * _RAY_FLOATS].view(np.float32)
    return Room(floats, floats.view(np.int32), floats.ctypes.data)


@part
def intersect(tree, room, origin, direction, far):
    """The first triangle along a ray as far as `far` (−1: none), its distance (infinite), u and v."""
    return intersect_beyond(tree, room, origin, direction, ZERO, far)


@part
def intersect_beyond(tree, room, origin, direction, near, far):
    """The first triangle along a ray between two distances, as `intersect`."""
    _aim(room, origin, direction, near, far)
    rtc_intersect(tree, room.address, 0)
    if room.integers[18] < 0:
        return _NONE, INFINITY, ZERO, ZERO
    return room.integers[17], room.floats[8], room.floats[15], room.floats[16]


@part
def occluded(tree, room, origin, direction, far):
    """Whether a ray meets a triangle as far as `far`."""
    _aim(room, origin, direction, ZERO, far)
    rtc_occluded(tree, room.address, 0)
    return room.floats[8] < ZERO


@part
def occluded_between(tree, room, origin, target):
    """Whether a triangle lies between two points; the last 1e-4 of the way is not looked at."""
    way = minus(target, origin)
    distance = length(way)
    # Unit directions: with longer ones Embree's own tolerances would scale with the distance
    direction = times(way, np.float32(1) / max(distance, _TINY))
    return occluded(tree, room, origin, direction, distance * SHORT_OF_TARGET)


@part
def _aim(room, origin, direction, near, far):
    ray, bits = room.floats, room.integers
    ray[0], ray[1], ray[2], ray[3] = origin[0], origin[1], origin[2], near  # and from which distance on
    ray[4], ray[5], ray[6], ray[7] = direction[0], direction[1], direction[2], ZERO  # and the time
    ray[8], bits[9], bits[10], bits[11] = far, _ALL, 0, 0  # to which distance, mask, number and flags
    bits[18], bits[19] = _NONE, _NONE  # geometry and instance that are met


@kernel
def intersect_all(tree, room, origins, directions, far, triangle, distance, u, v):
    """`intersect` of many."""
    for i in range(len(origins)):
        triangle[i], distance[i], u[i], v[i] = intersect(tree, room, row(origins, i), row(directions, i), far[i])


@kernel
def occluded_all(tree, room, origins, targets, result):
    """`occluded_between` of many."""
    for i in range(len(origins)):
        result[i] = occluded_between(tree, room, row(origins, i), row(targets, i))


class EmbreeTracer:
    """A `Tracer` on Embree's trees over the scene's triangles.

    Attributes
    ----------
    handles : (6 or 7,) uint64
        What kernels take: the tree that rays of each `RayKind` see, and of `BODIES` if there are any. They are valid as
        long as the tracer lives.
    """

    def __init__(self, scene: Scene) -> None:
        self._build(scene, lambda seen: EmbreeTree(scene.vertices, scene.triangles, seen[scene.object_of_triangle]))

    def _build(self, scene: Scene, build: Callable[[np.ndarray], EmbreeTree | TreeOfTrees]) -> None:
        """Take the trees that `build` makes of some of the scene's objects, (o,) bool."""
        self._normals = scene.normals
        self._trees = tree_of_each_kind(scene.objects, build)
        subsurface = scene.materials.subsurface[scene.material_of_triangle]
        if subsurface.any():
            bodies = np.bincount(scene.object_of_triangle[subsurface], minlength=len(scene.objects.names)) > 0
            self._trees.append(build(bodies))
        self.handles = np.array([tree.handle for tree in self._trees], np.uint64)

    def closest_hit(
        self,
        origins: np.ndarray,
        directions: np.ndarray,
        t_max: np.ndarray | float = np.inf,
        kind: RayKind = RayKind.DIFFUSE,
    ) -> Hits:
        """See `Tracer.closest_hit`."""
        n = len(origins)
        triangle, (distance, u, v) = np.empty(n, np.int32), np.empty((3, n), np.float32)
        far = np.full(n, t_max, np.float32)
        intersect_all(self.handles[kind], new_ray(), *_rays(origins, directions), far, triangle, distance, u, v)
        normal = rows(self._normals, triangle) if len(self._normals) else np.zeros((n, 3), np.float32)
        return Hits(triangle, distance, u, v, normal)

    def occluded(self, origins: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """See `Tracer.occluded`."""
        result = np.empty(len(origins), bool)
        occluded_all(self.handles[RayKind.SHADOW], new_ray(), *_rays(origins, targets), result)
        return result


def _rays(origins: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return kernel_array(origins, np.float32), kernel_array(others, np.float32)
