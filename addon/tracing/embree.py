"""Rays traced by Embree."""

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from ..core.sampling.vectors import dot, rows
from ..scene import Scene
from .protocol import Hits, RayKind, tree_of_each_kind

_SHORT_OF_TARGET = np.float32(1 - 1e-4)


class EmbreeTracer:
    """A `Tracer` on Embree's trees over the scene's triangles."""

    def __init__(self, scene: Scene) -> None:
        self._normals = scene.normals
        self._trees = tree_of_each_kind(scene.objects, lambda seen: _Tree(scene, seen[scene.object_of_triangle]))

    def closest_hit(
        self,
        origins: np.ndarray,
        directions: np.ndarray,
        t_max: np.ndarray | float = np.inf,
        kind: RayKind = RayKind.DIFFUSE,
    ) -> Hits:
        """See `Tracer.closest_hit`."""
        return self._trees[kind].closest_hit(origins, directions, t_max, self._normals)

    def occluded(self, origins: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """See `Tracer.occluded`."""
        return self._trees[RayKind.SHADOW].occluded(origins, targets)


class _Tree:
    """Embree's tree over those triangles of a scene that a mask includes."""

    def __init__(self, scene: Scene, included: np.ndarray) -> None:
        self._triangle = None if included.all() else np.flatnonzero(included).astype(np.int32)
        triangles = scene.triangles[included]
        self._empty = len(triangles) == 0
        if self._empty:
            return
        self._embree = EmbreeScene()
        TriangleMesh(self._embree, scene.vertices.astype(np.float32), triangles.astype(np.int32))
        # The tree is built by the first query, which must not be made from two threads at once.
        self._embree.run(np.zeros((1, 3), np.float32), np.array([[0, 0, 1]], np.float32))

    def closest_hit(
        self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray | float, normals: np.ndarray
    ) -> Hits:
        n = len(origins)
        if self._empty or n == 0:
            return Hits.none(n)
        limit = None if isinstance(t_max, float) and t_max == np.inf else np.full(n, t_max, np.float32)
        found = self._embree.run(origins, directions, dists=limit, output=True)
        primitive = found["primID"]
        miss = primitive < 0
        distance = found["tfar"]
        distance[miss] = np.inf
        triangle = primitive
        if self._triangle is not None:
            triangle = np.where(miss, np.int32(-1), self._triangle[primitive])
        return Hits(triangle, distance, found["u"], found["v"], rows(normals, triangle))

    def occluded(self, origins: np.ndarray, targets: np.ndarray) -> np.ndarray:
        if self._empty or len(origins) == 0:
            return np.zeros(len(origins), bool)
        way = targets - origins
        length = np.sqrt(dot(way, way))
        # Unit directions: with longer ones Embree's own tolerances would scale with the distance.
        directions = way / np.maximum(length, np.float32(1e-30))[:, None]
        return self._embree.run(origins, directions, dists=length * _SHORT_OF_TARGET, query="OCCLUDED") >= 0
