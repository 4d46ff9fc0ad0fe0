"""The faces of Blender's meshes, as they are laid flat."""

import bpy
import numpy as np

from ...receivers.uv_maps import Faces
from ..read.meshes.meshes import face_sizes, triangle_corners


def faces_of(mesh: "bpy.types.Mesh", linear: np.ndarray) -> Faces:
    """The faces of a mesh that stands in the world by a (3, 3) matrix; vertices that are nowhere lie at the origin."""
    positions, corners = np.empty((len(mesh.vertices), 3), np.float32), np.empty(len(mesh.loops), np.int32)
    mesh.vertices.foreach_get("co", positions.reshape(-1))  # edit mode hides attributes
    mesh.loops.foreach_get("vertex_index", corners)
    placed = np.nan_to_num((positions @ linear.T).astype(np.float32), posinf=0.0, neginf=0.0)
    return Faces(placed, corners, face_sizes(mesh), triangle_corners(mesh))
