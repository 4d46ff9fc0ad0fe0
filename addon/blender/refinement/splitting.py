"""Splits carried out on stored meshes, by Blender's own BMesh: it interpolates what vertices and corners hold."""

from collections.abc import Iterable, Iterator
from typing import Any

import bmesh
import bpy
import numpy as np

from ...core.progress import Progress
from ...pipeline.refinement import Refinement
from ..read.meshes.meshes import vectors

STAGE = "Splitting edges"

_OF = "photon_bake_refined_of"
"""Custom property of a refined copy: the mesh that it is a copy of, which so stays in the file."""

_FACE, _NORMAL = "photon_bake_face", "photon_bake_normal"
_SUFFIX = " (Refined)"
_EVERY = 1 << 14  # splits, the progress is told


def split_meshes(
    meshes: "dict[str, bpy.types.Mesh]", refinement: Refinement, on_copy: bool, progress: Progress
) -> "list[bpy.types.Mesh]":
    """Refine stored meshes, or copies of them that take their place in all objects; the meshes that are fine now.

    Shape keys, vertex groups, UV maps, attributes, seams, sharp edges and custom normals are kept.

    Parameters
    ----------
    meshes : dict of str to bpy.types.Mesh
        By their names in the refinement.

    Raises
    ------
    Cancelled
        If the progress was cancelled; nothing was changed then.
    """
    ready = []
    try:
        done, n = 0, max(refinement.n_vertices, 1)
        for name, mesh in meshes.items():
            if len(refinement.ends[name]):
                part = progress.part(done / n, (done := done + len(refinement.ends[name])) / n)
                ready.append((mesh, _split(mesh, refinement.ends[name], refinement.cut[name], part)))
        return [_put(mesh, bm, on_copy) for mesh, bm in ready]
    finally:
        for _, bm in ready:
            bm.free()


def _split(mesh: "bpy.types.Mesh", ends: np.ndarray, cut: np.ndarray, progress: Progress) -> Any:
    """A BMesh of a mesh, with edges split."""
    bm = bmesh.new()
    try:
        bm.from_mesh(mesh)
        if mesh.has_custom_normals:
            _keep_normals(bm, mesh)
        face_of = bm.faces.layers.int.new(_FACE)
        bm.verts.ensure_lookup_table()
        bm.faces.ensure_lookup_table()
        for i, face in enumerate(bm.faces):
            face[face_of] = i
        vertices, is_cut = list(bm.verts), np.zeros(len(bm.faces), bool)
        is_cut[cut] = True
        _triangulate(bm, mesh, is_cut, face_of)
        for i, (a, b) in enumerate(ends.tolist()):
            if i % _EVERY == 0:
                progress.update(STAGE, i / len(ends))
            vertices.append(_split_edge(bm, vertices[a], vertices[b], is_cut, face_of))
        bm.faces.layers.int.remove(face_of)
    except BaseException:
        bm.free()
        raise
    return bm


def _split_edge(bm: Any, a: Any, b: Any, is_cut: np.ndarray, face_of: Any) -> Any:
    """A new vertex halfway between two of one edge, from which triangles are cut to their opposite corners."""
    _, middle = bmesh.utils.edge_split(bm.edges.get((a, b)), a, 0.5)
    for face in list(middle.link_faces):
        if is_cut[face[face_of]] and len(face.verts) == 4:
            opposite = next(one for one in face.verts if one not in (a, middle, b))
            bmesh.utils.face_split(face, middle, opposite)
    return middle


def _triangulate(bm: Any, mesh: "bpy.types.Mesh", is_cut: np.ndarray, face_of: Any) -> None:
    """Cut faces into the triangles that Blender shows them by."""
    mesh.calc_loop_triangles()
    n = len(mesh.loop_triangles)
    corners, polygon = np.empty((n, 3), np.int32), np.empty(n, np.int32)
    mesh.loop_triangles.foreach_get("vertices", corners.reshape(-1))
    mesh.loop_triangle_polygons.foreach_get("value", polygon)
    vertices, faces = list(bm.verts), list(bm.faces)
    for i in np.flatnonzero(is_cut).tolist():
        if len(faces[i].verts) == 3:
            continue
        sides = {frozenset((one.vert, one.link_loop_next.vert)) for one in faces[i].loops}
        first, last = np.searchsorted(polygon, [i, i + 1])
        for triangle in corners[first:last].tolist():
            for a, b in zip(triangle, (*triangle[1:], triangle[0]), strict=True):
                side = frozenset((vertices[a], vertices[b]))
                if side not in sides:
                    sides.add(side)
                    face = next(
                        one for one in vertices[a].link_faces if one[face_of] == i and vertices[b] in one.verts[:]
                    )
                    bmesh.utils.face_split(face, vertices[a], vertices[b])


def _keep_normals(bm: Any, mesh: "bpy.types.Mesh") -> None:
    """Hold the corners' normals, which BMesh interpolates as vectors, unlike how meshes store custom ones."""
    layer = bm.loops.layers.float_vector.new(_NORMAL)
    for loop, normal in zip(
        (loop for face in bm.faces for loop in face.loops), vectors(mesh.corner_normals).tolist(), strict=True
    ):
        loop[layer] = normal


def _put(mesh: "bpy.types.Mesh", bm: Any, on_copy: bool) -> "bpy.types.Mesh":
    """Write a BMesh to a mesh, or to a copy that takes its place."""
    target = mesh.copy() if on_copy else mesh
    bm.to_mesh(target)
    normals = target.attributes.get(_NORMAL)
    if normals is not None:
        values = vectors(normals.data)
        target.attributes.remove(normals)
        values /= np.maximum(np.linalg.norm(values, axis=1, keepdims=True), np.float32(1e-30))
        target.normals_split_custom_set(values)
    target.update()
    if on_copy:
        target[_OF] = target.get(_OF) or mesh  # a copy is of an earlier copy's original
        target.rename(target[_OF].name + _SUFFIX, mode="ALWAYS")
        for obj in _users(mesh):
            obj.data = target
    return target


def _users(mesh: "bpy.types.Mesh") -> "Iterator[bpy.types.Object]":
    return (obj for obj in list(bpy.data.objects) if obj.data == mesh and obj.is_editable)


def has_refined_copies(objects: "Iterable[bpy.types.Object] | None" = None) -> bool:
    """Whether an object, of some or of all, shows a refined copy."""
    return next(_with_copies(objects), None) is not None


def restore_meshes(objects: "Iterable[bpy.types.Object] | None" = None) -> int:
    """Give objects, some or all, the meshes back that refined copies stand for; returns how many objects had one."""
    found = list(_with_copies(objects))
    copies = {obj.data for obj in found}
    for obj in found:
        obj.data = obj.data[_OF]
    bpy.data.batch_remove([copy for copy in copies if not copy.users])
    return len(found)


def _with_copies(objects: "Iterable[bpy.types.Object] | None") -> "Iterator[bpy.types.Object]":
    every = bpy.data.objects if objects is None else objects
    return (obj for obj in list(every) if obj.type == "MESH" and obj.is_editable and obj.data.get(_OF) is not None)
