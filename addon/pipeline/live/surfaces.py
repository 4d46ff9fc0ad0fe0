"""What live light is found on and drawn on: the scene's meshes, split where shading normals or UVs do, and refined."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...receivers import ReceiverMesh, Receivers, vertex_receivers
from ...scene import Scene
from ...settings.live import LiveSettings
from .refined import Corners, refined

_LEAST_PARTS = 1000
"""Of the scene's diagonal: finer than that no surface is cut without being told to."""

_MIX = np.uint64(0x9E3779B97F4A7C15)


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
    on : (v,) int64
        Which of the object's triangles in the scene each vertex is on; of several one.
    weight : (v, 3) float32
        Barycentric coordinates there.
    """

    object: int
    vertices: slice
    position: np.ndarray
    normal: np.ndarray
    uv: np.ndarray
    triangles: np.ndarray
    material: np.ndarray
    on: np.ndarray
    weight: np.ndarray

    def reshaped(self, corners: np.ndarray, corner_normals: np.ndarray) -> "LiveMesh":
        """The same vertices where the object's triangles have their corners elsewhere, (t, 3, 3) each."""
        position, normal = (
            np.einsum("vc,vck->vk", self.weight, values[self.on].astype(np.float32))
            for values in (corners, corner_normals)
        )
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        return replace(self, position=position, normal=normal)


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

    def reshaped(self, number: int, corners: np.ndarray, corner_normals: np.ndarray) -> "LiveSurfaces":
        """The same with one object's vertices elsewhere."""
        meshes = (mesh.reshaped(corners, corner_normals) if mesh.object == number else mesh for mesh in self.meshes)
        return LiveSurfaces(tuple(meshes))

    def receivers(self) -> Receivers:
        """Receivers at the vertices, as a bake has them."""
        meshes = [
            ReceiverMesh(
                object_name="",
                mesh_name="",
                domain="POINT",
                positions=mesh.position,
                normals=mesh.normal,
                corner_vertex=mesh.triangles.ravel(),
                corner_face=np.repeat(np.arange(len(mesh.triangles), dtype=np.int32), 3),
            )
            for mesh in self.meshes
        ]
        return vertex_receivers(meshes)


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
        triangles, source = triangles.reshape(-1, 3).astype(np.int32), corners.source[start:end]
        on, weight = _places(scene, source, triangles, corners.position[used])
        meshes.append(
            LiveMesh(
                object=int(of_triangle[start]),
                vertices=slice(first, first + len(used)),
                position=corners.position[used],
                normal=corners.normal[used],
                uv=corners.uv[used],
                triangles=triangles,
                material=scene.material_of_triangle[source],
                on=np.unique(source, return_inverse=True)[1].reshape(-1)[on],
                weight=weight,
            )
        )
        first += len(used)
    return LiveSurfaces(tuple(meshes))


def _places(
    scene: Scene, source: np.ndarray, triangles: np.ndarray, position: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """For each vertex one of the triangles (t, 3) that have it, and barycentric coordinates in that one's source."""
    on = np.empty(len(position), np.int64)
    on[triangles.ravel()] = np.repeat(np.arange(len(triangles)), 3)
    a, b, c = scene.vertices[scene.triangles[source[on]]].astype(np.float64).transpose(1, 0, 2)
    ab, ac, ap = b - a, c - a, position - a
    bb, bc, cc, pb, pc = (np.einsum("vk,vk->v", *pair) for pair in ((ab, ab), (ab, ac), (ac, ac), (ap, ab), (ap, ac)))
    area = np.maximum(bb * cc - bc * bc, 1e-60)
    v, w = (cc * pb - bc * pc) / area, (bb * pc - bc * pb) / area
    return on, np.stack([1 - v - w, v, w], axis=1).astype(np.float32)


def _split(scene: Scene, order: np.ndarray) -> Corners:
    """The scene's triangles in an order, with a vertex for each position, normal, UV and object of a corner.

    These are told apart by a hash of 64 bits: sorting rows would hold Python's lock. Of a million two are taken for one
    with a chance of 3e-8.
    """
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
