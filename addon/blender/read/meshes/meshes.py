"""Evaluated meshes as triangles in their local space."""

from dataclasses import dataclass
from typing import Protocol

import bpy
import numpy as np


@dataclass(frozen=True)
class LocalMesh:
    """Triangles of one mesh in its local space; v vertices, t triangles, n normals.

    Attributes
    ----------
    vertices : (v, 3) float32
        Only those that triangles use.
    triangles : (t, 3) int32
    normals : (n, 3) float32
        One a vertex, a face or a corner, as the mesh has them.
    normal_of_corner : (t, 3) int32
    corners : (t, 3) int32
        The mesh's corner at each triangle corner.
    material_slot : (t,) int32
    uvs : CornerUVs
    """

    vertices: np.ndarray
    triangles: np.ndarray
    normals: np.ndarray
    normal_of_corner: np.ndarray
    corners: np.ndarray
    material_slot: np.ndarray
    uvs: "CornerUVs"


class CornerUVs(Protocol):
    """Texture coordinates by the name of their map."""

    def corners(self, name: str) -> np.ndarray:
        """Those of a mesh's corners, (c, 2) float32, or of what takes their place."""


class UVMaps:
    """UV maps of an evaluated mesh, read when first asked for. Lives no longer than the dependency graph."""

    def __init__(self, mesh: "bpy.types.Mesh") -> None:
        self._mesh = mesh
        self._read: dict[str, np.ndarray] = {}

    def corners(self, name: str) -> np.ndarray:
        """Texture coordinates of the mesh's corners, (c, 2) float32.

        Parameters
        ----------
        name : str
            Of the UV map, or of any attribute that can stand for one; empty for the map that is active for rendering.
            Zero where there is none, as in Cycles.
        """
        if name not in self._read:
            layers = self._mesh.uv_layers
            layer = layers.get(name) if name else next((one for one in layers if one.active_render), None)
            other = self._mesh.attributes.get(name) if name else None
            values = np.zeros((len(self._mesh.loops), 2), np.float32)
            if layer is not None:
                layer.uv.foreach_get("vector", values.reshape(-1))
            elif other is not None and other.data_type in VALUE_OF:
                values = _at_corners(self._mesh, other)
            self._read[name] = np.nan_to_num(values, posinf=0.0, neginf=0.0)
        return self._read[name]


def evaluated_mesh(obj: "bpy.types.Object", depsgraph: "bpy.types.Depsgraph") -> "bpy.types.Mesh":
    """The mesh of an evaluated mesh object with all its modifiers; lives no longer than the dependency graph.

    In edit mode Blender evaluates what the mode shows, often without an array to read.
    """
    if not obj.data.is_editmode:
        return obj.data
    return obj.to_mesh(preserve_all_data_layers=True, depsgraph=depsgraph)


VALUE_OF = {
    "FLOAT2": ("vector", 2),
    "FLOAT_VECTOR": ("vector", 3),
    "FLOAT_COLOR": ("color", 4),
    "BYTE_COLOR": ("color", 4),
    "FLOAT": ("value", 1),
    "INT": ("value", 1),
    "BOOLEAN": ("value", 1),
}
"""What holds the values of an attribute of each type that Cycles reads coordinates from, and how many there are."""


def _at_corners(mesh: "bpy.types.Mesh", one: "bpy.types.Attribute") -> np.ndarray:
    """The first two values of an attribute at a mesh's corners, (c, 2) float32; those of edges by way of vertices."""
    prop, width = VALUE_OF[one.data_type]
    values = np.empty((len(one.data), width), np.float32)
    one.data.foreach_get(prop, values.reshape(-1))
    values = values[:, :2] if width > 1 else np.repeat(values, 2, axis=1)
    if one.domain == "EDGE":
        values = _mean_of_edges(mesh, values)
    if one.domain in {"POINT", "EDGE"}:
        return values.take(corner_vertex(mesh), axis=0)
    if one.domain == "FACE":
        return np.repeat(values, face_sizes(mesh), axis=0)
    return values


def _mean_of_edges(mesh: "bpy.types.Mesh", values: np.ndarray) -> np.ndarray:
    """Mean values (e, 2) of the edges at each vertex, (v, 2) float32."""
    n, ends = len(mesh.vertices), attribute(mesh, ".edge_verts", "value", (len(mesh.edges), 2), np.int32)
    totals = [np.bincount(ends.ravel(), np.repeat(column, 2), n) for column in values.T]
    n_edges = np.maximum(np.bincount(ends.ravel(), minlength=n), 1)
    return (np.stack(totals, axis=1) / n_edges[:, None]).astype(np.float32)


def count_triangles(mesh: "bpy.types.Mesh") -> int:
    """Triangles that a mesh's faces are cut into, without cutting them: a face of n corners gives n − 2."""
    return len(mesh.loops) - 2 * len(mesh.polygons)


def read_mesh(mesh: "bpy.types.Mesh") -> LocalMesh:
    """The triangles of an evaluated mesh that has faces."""
    corners = triangle_corners(mesh)
    n = len(corners)
    vertices = attribute(mesh, "position", "vector", (len(mesh.vertices), 3), np.float32)
    triangles = corner_vertex(mesh).take(corners)
    normals, normal_of_corner = _read_normals(mesh, triangles, corners)
    used = _used(len(vertices), triangles)
    if used is not None:
        per_vertex = normal_of_corner is triangles
        vertices, triangles = vertices[used], (np.cumsum(used, dtype=np.int32) - 1).take(triangles)
        normals, normal_of_corner = (normals[used], triangles) if per_vertex else (normals, normal_of_corner)
    return LocalMesh(vertices, triangles, normals, normal_of_corner, corners, _read_slots(mesh, n), UVMaps(mesh))


def triangle_corners(mesh: "bpy.types.Mesh") -> np.ndarray:
    """The corners of the triangles that renders cut an evaluated mesh's faces into, (t, 3) int32."""
    mesh.calc_loop_triangles()
    # Into another type Blender would copy value by value, a hundred times as slowly: "loops" are unsigned.
    corners = np.empty((len(mesh.loop_triangles), 3), np.uint32)
    mesh.loop_triangles.foreach_get("loops", corners.ravel())
    return corners.view(np.int32)


def attribute(mesh: "bpy.types.Mesh", name: str, prop: str, shape: tuple[int, ...], dtype: type) -> np.ndarray:
    """Values of a mesh attribute, zero where the mesh does not have it."""
    values: np.ndarray = np.zeros(shape, dtype)
    found = mesh.attributes.get(name)
    if found is not None:
        found.data.foreach_get(prop, values.reshape(-1))
    return values


def corner_vertex(mesh: "bpy.types.Mesh") -> np.ndarray:
    """The vertex at each corner, (c,) int32."""
    return attribute(mesh, ".corner_vert", "value", (len(mesh.loops),), np.int32)  # `loops` are slow to read


def face_sizes(mesh: "bpy.types.Mesh") -> np.ndarray:
    """How many corners each face has, (f,) int32."""
    sizes = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_total", sizes)
    return sizes


def _read_normals(mesh: "bpy.types.Mesh", triangles: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shading normals (n, 3) float32 where the mesh keeps them, and which one each triangle corner has, (t, 3) int32.

    Smooth and flat meshes have fewer of them than corners.
    """
    domain = mesh.normals_domain
    if domain == "POINT":
        return vectors(mesh.vertex_normals), triangles
    if domain == "FACE":
        return vectors(mesh.polygon_normals), np.repeat(_faces(mesh, len(triangles)), 3).reshape(-1, 3)
    return vectors(mesh.corner_normals), corners


def vectors(values: "bpy.types.bpy_prop_collection") -> np.ndarray:
    """A collection of vectors, such as a mesh's normals, (n, 3) float32."""
    found = np.empty((len(values), 3), np.float32)
    values.foreach_get("vector", found.reshape(-1))
    return found


def _faces(mesh: "bpy.types.Mesh", n: int) -> np.ndarray:
    """The face of each of n triangles, (t,) int32."""
    face = np.empty(n, np.int32)
    mesh.loop_triangle_polygons.foreach_get("value", face)
    return face


def used_slots(mesh: "bpy.types.Mesh") -> list[int]:
    """The material slots that faces of a mesh use, ascending."""
    slot = _slot_of_face(mesh)
    return [0] if slot is None else np.flatnonzero(np.bincount(slot)).tolist()


def _slot_of_face(mesh: "bpy.types.Mesh") -> np.ndarray | None:
    """The material slot of each face, (f,) int32; None for the first of all."""
    if mesh.attributes.get("material_index") is None:
        return None
    return np.maximum(attribute(mesh, "material_index", "value", (len(mesh.polygons),), np.int32), 0)


def _read_slots(mesh: "bpy.types.Mesh", n: int) -> np.ndarray:
    """The material slot of each of n triangles, (t,) int32."""
    slot = _slot_of_face(mesh)
    return np.zeros(n, np.int32) if slot is None else slot.take(_faces(mesh, n))


def _used(n_vertices: int, triangles: np.ndarray) -> np.ndarray | None:
    """Which vertices triangles use, or None for all of them. The others would widen the scene's bounds."""
    used = np.zeros(n_vertices, bool)
    used[triangles.reshape(-1)] = True
    return None if used.all() else used
