"""Charts: the faces of a mesh laid flat, in metres, by Blender's Smart UV Project.

Blender unwraps faces whole, which UV maps ask for: cutting them into triangles first, as xatlas does, lets borders of
charts run through faces. tests/bench/lightmap_uvs.py compares the two.
"""

from dataclasses import dataclass
from math import radians
from typing import Any

import bpy
import numpy as np

from ...receivers import Charts, LightmapMesh
from ..meshes import attribute, read_mesh
from ..temporary import Temporary


@dataclass(frozen=True)
class Faces:
    """The faces of a mesh that is to be laid flat: v vertices, c corners, f faces, t triangles.

    Attributes
    ----------
    positions : (v, 3) float32, m
        As large as in the world; turned in any way.
    corner_vertex : (c,) int32
    n_corners : (f,) int32
        Of each face; their corners follow each other.
    triangles : (t, 3) int32
        Corners of the triangles that the faces are cut into.
    """

    positions: np.ndarray
    corner_vertex: np.ndarray
    n_corners: np.ndarray
    triangles: np.ndarray

    @staticmethod
    def of(mesh: "bpy.types.Mesh", linear: np.ndarray) -> "Faces":
        """The faces of an original mesh that stands in the world by a (3, 3) matrix."""
        positions = attribute(mesh, "position", "vector", (len(mesh.vertices), 3), np.float32)
        n_corners = np.empty(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("loop_total", n_corners)
        corner_vertex = attribute(mesh, ".corner_vert", "value", (len(mesh.loops),), np.int32)
        return Faces((positions @ linear.T).astype(np.float32), corner_vertex, n_corners, read_mesh(mesh).corners)

    def where(self, chosen: np.ndarray) -> "Faces":
        """The faces that a mask (f,) chooses."""
        corner = chosen[self.face_of_corner()]
        number = np.cumsum(corner, dtype=np.int32) - 1
        triangles = self.triangles[corner[self.triangles[:, 0]]]
        return Faces(self.positions, self.corner_vertex[corner], self.n_corners[chosen], number[triangles])

    def face_of_corner(self) -> np.ndarray:
        """The face of each corner, (c,) int32."""
        return np.repeat(np.arange(len(self.n_corners), dtype=np.int32), self.n_corners)

    def corners(self) -> np.ndarray:
        """Positions of the triangles' corners, (t, 3, 3) float32, m."""
        return self.positions[self.corner_vertex[self.triangles]]

    @property
    def area(self) -> float:
        """Of all triangles, m²."""
        return float(areas(self.corners()).sum())


def areas(corners: np.ndarray) -> np.ndarray:
    """Areas of triangles with corners (t, 3, 2) or (t, 3, 3), (t,) float64."""
    first = (corners[:, 1] - corners[:, 0]).astype(np.float64)
    second = (corners[:, 2] - corners[:, 0]).astype(np.float64)
    if corners.shape[2] == 2:
        return np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2
    return np.linalg.norm(np.cross(first, second), axis=1) / 2


def chart_of_triangles(faces: Faces, uv: np.ndarray) -> np.ndarray:
    """The chart of each triangle by texture coordinates (c, 2) of the corners, (t,) int32."""
    corners = faces.corners()
    low = uv.min(axis=0, initial=0)
    unit = (uv - low) / max(float((uv - low).max(initial=0)), 1e-30)
    return Charts.of([LightmapMesh("", 0, corners, np.zeros_like(corners), unit[faces.triangles])]).chart


def laid_flat(faces: Faces, angle: float) -> np.ndarray:
    """Texture coordinates of the corners in metres, each chart apart from the others, (c, 2) float32.

    Their size is right on average; a face at an angle α to its chart's plane is smaller by cos α.
    """
    with Temporary() as temporary:
        mesh = _mesh(faces, temporary)
        with EditMode(mesh, temporary):
            bpy.ops.uv.smart_project(angle_limit=radians(angle), island_margin=0, scale_to_bounds=False)
        uv = np.empty((len(mesh.loops), 2), np.float32)
        mesh.uv_layers[0].uv.foreach_get("vector", uv.reshape(-1))
    in_space, flat = areas(faces.corners()), areas(uv[faces.triangles])
    return uv * np.float32(_middle_ratio(in_space, flat))


def _middle_ratio(in_space: np.ndarray, flat: np.ndarray) -> float:
    """Metres a unit of UV, such that half of the surface has more; 1 where nothing has an area."""
    ratio = np.sqrt(in_space / np.maximum(flat, 1e-30))
    order = np.argsort(ratio)
    share = np.cumsum(in_space[order])
    if not share.size or not share[-1] > 0:
        return 1.0
    return float(ratio[order[np.searchsorted(share, share[-1] / 2)]])


def _mesh(faces: Faces, temporary: Temporary) -> "bpy.types.Mesh":
    """The faces as a mesh of Blender's whose vertices are joined where they lie in one place."""
    mesh = temporary.add(bpy.data.meshes.new("Photon Bake"))
    mesh.vertices.add(len(faces.positions))
    mesh.vertices.foreach_set("co", faces.positions.reshape(-1))
    mesh.loops.add(len(faces.corner_vertex))
    mesh.loops.foreach_set("vertex_index", _joined(faces))
    mesh.polygons.add(len(faces.n_corners))
    mesh.polygons.foreach_set("loop_start", np.cumsum(faces.n_corners, dtype=np.int32) - faces.n_corners)
    mesh.uv_layers.new(name=mesh.name)
    mesh.update(calc_edges=True)
    return mesh


def _joined(faces: Faces) -> np.ndarray:
    """Vertices of the corners, the same where places are, (c,) int32; not in faces that would lose a corner by it."""
    place = np.ascontiguousarray(faces.positions + np.float32(0)).view([("", np.float32)] * 3)
    _, first, same = np.unique(place, return_index=True, return_inverse=True)
    joined = first[same.reshape(-1)].astype(np.int32)[faces.corner_vertex]
    face = faces.face_of_corner()
    order = np.lexsort([joined, face])
    twice = (np.diff(face[order]) == 0) & (np.diff(joined[order]) == 0)
    spoilt = np.isin(face, face[order][1:][twice])
    return np.where(spoilt, faces.corner_vertex, joined)


class EditMode:
    """A mesh of our own, all selected, in edit mode and in a scene of its own, for Blender's UV operators."""

    def __init__(self, mesh: "bpy.types.Mesh", temporary: Temporary) -> None:
        scene = temporary.add(bpy.data.scenes.new("Photon Bake"))
        obj = temporary.add(bpy.data.objects.new("Photon Bake", mesh))
        scene.collection.objects.link(obj)
        layer = scene.view_layers[0]
        obj.select_set(True, view_layer=layer)
        layer.objects.active = obj
        self._context: dict[str, Any] = {"scene": scene, "view_layer": layer, "active_object": obj, "object": obj}
        self._context |= {"selected_objects": [obj], "selected_editable_objects": [obj]}
        self._obj = obj

    def __enter__(self) -> None:
        with bpy.context.temp_override(**self._context):
            bpy.ops.object.mode_set(mode="EDIT")
        self._override = bpy.context.temp_override(edit_object=self._obj, **self._context)
        self._override.__enter__()
        bpy.ops.mesh.select_all(action="SELECT")

    def __exit__(self, *error: Any) -> None:
        bpy.ops.object.mode_set(mode="OBJECT")
        self._override.__exit__(*error)
