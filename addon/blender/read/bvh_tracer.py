"""Blender's own BVH behind the `Tracer` protocol, for where Embree cannot be imported.

It traces one ray at a time under Python's lock, about a hundred times slower than Embree.
"""

from itertools import starmap

import numpy as np
from mathutils.bvhtree import BVHTree

from ...scene import RayKind, Scene
from ...tracing.protocol import Hits, tree_of_each_kind

FARTHEST = 1e18
"""Stands for an infinite distance, m; `BVHTree` takes none."""


class BVHTracer:
    """Finds where rays meet a scene, with `mathutils.bvhtree`.

    Parameters
    ----------
    scene : Scene
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._trees = tree_of_each_kind(scene.objects, lambda seen: _Tree(scene, seen[scene.object_of_triangle]))

    def closest_hit(
        self,
        origins: np.ndarray,
        directions: np.ndarray,
        t_max: np.ndarray | float = np.inf,
        kind: RayKind = RayKind.DIFFUSE,
    ) -> Hits:
        """The first triangle that rays of a kind see along each ray; see `Tracer.closest_hit`."""
        triangle, distance = self._trees[kind].cast(origins, directions, np.full(len(origins), t_max))
        hit = triangle >= 0
        u, v = np.zeros((2, len(origins)), np.float32)
        normal = np.zeros((len(origins), 3), np.float32)
        points = origins[hit] + directions[hit] * distance[hit, None]
        u[hit], v[hit] = self._scene.barycentrics(triangle[hit], points)
        normal[hit] = self._scene.normals[triangle[hit]]
        return Hits(triangle, distance, u, v, normal)

    def occluded(self, origins: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """Whether a triangle that casts shadows lies between origin and target; see `Tracer.occluded`."""
        way = targets.astype(np.float64) - origins
        length = np.linalg.norm(way, axis=1)
        directions = way / np.where(length > 0, length, 1.0)[:, None]
        triangle, _ = self._trees[RayKind.SHADOW].cast(origins, directions, length * (1 - 1e-4))
        return triangle >= 0


class _Tree:
    """A BVH of those triangles of a scene that a mask includes."""

    def __init__(self, scene: Scene, included: np.ndarray) -> None:
        triangles = np.flatnonzero(included)
        self._triangle = np.append(triangles, -1).astype(np.int32)
        # An epsilon of 0 makes the test of a ray against a triangle watertight.
        self._tree = BVHTree.FromPolygons(
            scene.vertices.tolist(), scene.triangles[triangles].tolist(), all_triangles=True, epsilon=0.0
        )

    def cast(self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Triangle (n,) int32, −1 for none, and distance (n,) float32 of each ray's first hit."""
        farthest = np.minimum(t_max, FARTHEST)
        rays = zip(origins.tolist(), directions.tolist(), farthest.tolist(), strict=True)
        ends = [(index, distance) for _, _, index, distance in starmap(self._tree.ray_cast, rays)]
        index = np.array([-1 if i is None else i for i, _ in ends], np.int64).reshape(-1)
        distance = np.array([np.inf if i is None else d for i, d in ends], np.float32).reshape(-1)
        return self._triangle[index], distance
