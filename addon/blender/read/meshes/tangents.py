"""Tangents at a mesh's corners, which normal maps and anisotropy are given by: along UV maps, or around an axis."""

import bpy
import numpy as np

from ...temporary import Temporary
from .meshes import LocalMesh


def corner_tangents(mesh: LocalMesh, uv_map: str) -> np.ndarray:
    """Tangent and bitangent of each triangle corner in the mesh's own space, (t, 3, 2, 3) float32.

    Blender finds them (MikkTSpace) on the triangles, as Cycles does; where there is no UV map they are zero.

    Parameters
    ----------
    uv_map : str
        Its name; empty for the one that is active for rendering.
    """
    n = len(mesh.triangles)
    uvs = mesh.uvs.corners(uv_map).take(mesh.corners.ravel(), 0)
    normals = mesh.normals.take(mesh.normal_of_corner.ravel(), 0)
    tangents, signs = np.zeros((3 * n, 3), np.float32), np.ones(3 * n, np.float32)
    if uvs.any():
        with Temporary() as temporary:
            copy = _triangles_alone(mesh, uvs, normals, temporary)
            copy.calc_tangents(uvmap=copy.uv_layers[0].name)
            copy.loops.foreach_get("tangent", tangents.ravel())
            copy.loops.foreach_get("bitangent_sign", signs)
    bitangents = np.cross(normals, tangents) * signs[:, None]
    return np.stack([tangents, bitangents], axis=1).reshape(n, 3, 2, 3).astype(np.float32)


def tangents_around(mesh: LocalMesh, axis: str, centre: np.ndarray, half_size: np.ndarray) -> np.ndarray:
    """Tangents at each triangle corner around an axis of the generated coordinates, (t, 3, 3) float32, of any length.

    Parameters
    ----------
    axis : "X", "Y" or "Z"
    centre, half_size : (3,)
        Of the mesh's texture space, in which generated coordinates go from 0 to 1.
    """
    x, y, z = ((mesh.vertices - centre) / np.where(half_size == 0, np.inf, half_size)).astype(np.float32).T
    none = np.zeros_like(x)
    around = {"X": (none, -z, y), "Y": (-z, none, x), "Z": (-y, x, none)}[axis]
    return np.stack(around, axis=1).take(mesh.triangles, 0)


def _triangles_alone(mesh: LocalMesh, uvs: np.ndarray, normals: np.ndarray, temporary: Temporary) -> "bpy.types.Mesh":
    """A mesh of the triangles, with texture coordinates (3 t, 2) and normals (3 t, 3) at its corners."""
    n = len(mesh.triangles)
    copy = temporary.add(bpy.data.meshes.new("Photon Bake"))
    copy.vertices.add(len(mesh.vertices))
    copy.vertices.foreach_set("co", mesh.vertices.ravel())
    copy.loops.add(3 * n)
    copy.loops.foreach_set("vertex_index", mesh.triangles.ravel())
    copy.polygons.add(n)
    copy.polygons.foreach_set("loop_start", np.arange(0, 3 * n, 3, dtype=np.int32))
    copy.update()
    copy.uv_layers.new(name="UVMap", do_init=False).uv.foreach_set("vector", uvs.ravel())
    copy.attributes.new("custom_normal", "FLOAT_VECTOR", "CORNER").data.foreach_set("vector", normals.ravel())
    return copy
