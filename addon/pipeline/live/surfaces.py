"""What live light is found on and drawn on: the scene's meshes, split where shading normals or UVs do, and refined."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...receivers import Receivers
from ...receivers.vertices import CORNER_PULL, LIFT, NUDGE
from ...scene import Scene
from ...settings.live import LiveSettings
from .refined import Corners, refined


@dataclass(frozen=True)
class LiveMesh:
    """The surface of one object of the scene; v vertices, t triangles.

    Attributes
    ----------
    object : int
        Its number in `Scene.objects`.
    vertices : slice
        Of the rows of the light, and of the arrays of `LiveSurfaces`, those that are this mesh's.
    position : (v, 3) float32, m
        World space, where the scene that was read has the object; see `ObjectMoved`.
    normal : (v, 3) float32
        Unit shading normals.
    uv : (v, 2) float32
        As `Scene.corner_uvs`.
    triangles : (t, 3) int32
        Numbers of the mesh's own vertices, from 0.
    material : (t,) int32
        Row of `Scene.materials` of each triangle.
    """

    object: int
    vertices: slice
    position: np.ndarray
    normal: np.ndarray
    uv: np.ndarray
    triangles: np.ndarray
    material: np.ndarray


@dataclass(frozen=True)
class LiveSurfaces:
    """All meshes of a scene, in the order of their objects; n vertices in all.

    Attributes
    ----------
    meshes : tuple of LiveMesh
    """

    meshes: tuple[LiveMesh, ...]

    def __len__(self) -> int:
        return self.meshes[-1].vertices.stop if self.meshes else 0

    @cached_property
    def object_of_vertex(self) -> np.ndarray:
        """Object of each vertex, (n,) int32."""
        counts = [len(mesh.position) for mesh in self.meshes]
        return np.repeat(np.array([mesh.object for mesh in self.meshes], np.int32), counts)

    def receivers(self) -> Receivers:
        """Receivers at the vertices, pulled into their own faces and lifted off them as those of a bake are."""
        parts = [_receivers(mesh) for mesh in self.meshes]
        if parts:
            return Receivers.join(parts)
        nothing = np.zeros((0, 3), np.float32)
        return Receivers(nothing, nothing, nothing[:, 0])


def live_surfaces(scene: Scene, settings: LiveSettings) -> LiveSurfaces:
    """The surfaces of a scene, cut until no edge is longer than the settings' spacing or there are enough vertices."""
    order = np.argsort(scene.object_of_triangle, kind="stable")
    spacing, n_most = settings.spacing or scene.diagonal / _LEAST_PARTS, settings.n_vertices
    corners = refined(_split(scene, order), spacing, n_most)
    meshes, first = [], 0
    of_triangle = scene.object_of_triangle[corners.source]
    starts = np.flatnonzero(np.diff(of_triangle, prepend=-1))
    for start, end in zip(starts, [*starts[1:], len(of_triangle)], strict=True):
        used, triangles = np.unique(corners.triangles[start:end], return_inverse=True)
        meshes.append(
            LiveMesh(
                object=int(of_triangle[start]),
                vertices=slice(first, first + len(used)),
                position=corners.position[used],
                normal=corners.normal[used],
                uv=corners.uv[used],
                triangles=triangles.reshape(-1, 3).astype(np.int32),
                material=scene.material_of_triangle[corners.source[start:end]],
            )
        )
        first += len(used)
    return LiveSurfaces(tuple(meshes))


_LEAST_PARTS = 1000
"""Of the scene's diagonal: finer than that no surface is cut without being told to."""


def _split(scene: Scene, order: np.ndarray) -> Corners:
    """The scene's triangles in an order, with a vertex for each position, normal, UV and object of a corner."""
    triangles = scene.triangles[order]
    position = scene.vertices[triangles].reshape(-1, 3)
    normal, uv = scene.corner_normals[order].reshape(-1, 3), scene.corner_uvs[order].reshape(-1, 2)
    key = np.repeat(scene.object_of_triangle[order], 3).astype(np.uint64)
    for column, scale in ((position, 0), (normal, 100), (uv, 1 << 14)):
        for values in column.T:
            whole = values.view(np.uint32) if scale == 0 else np.rint(values * scale).astype(np.int64).view(np.uint64)
            key = (key ^ whole.astype(np.uint64)) * _MIX
            key ^= key >> np.uint64(29)
    _, first, vertex = np.unique(key, return_index=True, return_inverse=True)
    return Corners(position[first], normal[first], uv[first], vertex.reshape(-1, 3).astype(np.int64), order)


_MIX = np.uint64(0x9E3779B97F4A7C15)


def _receivers(mesh: LiveMesh) -> Receivers:
    """Those of one mesh; see `vertex_receivers`."""
    vertex, n = mesh.triangles.ravel(), len(mesh.position)
    corners = mesh.position.astype(np.float64)[mesh.triangles]
    way = np.repeat(corners.mean(axis=1), 3, axis=0) - corners.reshape(-1, 3)
    count = np.maximum(np.bincount(vertex, minlength=n), 1)
    to_middle = np.stack([np.bincount(vertex, way[:, k], n) / count for k in range(3)], axis=1)
    reach = np.bincount(vertex, np.linalg.norm(way, axis=1), n) / count
    normal = mesh.normal.astype(np.float64)
    down = np.minimum((to_middle * normal).sum(axis=1, keepdims=True), 0) * normal
    nudge = NUDGE * np.abs(mesh.position).max(axis=1, initial=0)
    pull = np.minimum(np.maximum(CORNER_PULL, nudge / np.maximum(reach, 1e-30)), 1)[:, None]
    position = mesh.position + pull * (to_middle - down) + LIFT * reach[:, None] * normal
    return Receivers(position.astype(np.float32), mesh.normal, reach.astype(np.float32))
