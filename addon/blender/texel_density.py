"""Where lightmaps' texels lie on objects, and how many there are a metre: for the viewport."""

from dataclasses import dataclass
from math import sqrt

import bpy
import numpy as np

from ..lightmap_settings import MADE_UV_MAP, LightmapSettings
from ..receivers.uv_maps import whole_blocks
from .lightmap.images import lightmaps_by_file
from .lightmap.writing import IMAGE, SCALE_OFFSET, UV_MAP
from .meshes import corner_vertex
from .overrides import density_factor


@dataclass(frozen=True)
class TexelSurface:
    """An object's triangles with their texels; c corners, three a triangle.

    Attributes
    ----------
    position : (c, 3) float32
        Object space.
    texel : (c, 2) float32
        In the image.
    density : (c,) float32
        Texels a metre in the corner's triangle.
    """

    position: np.ndarray
    texel: np.ndarray
    density: np.ndarray


def texel_surface(
    obj: "bpy.types.Object", depsgraph: "bpy.types.Depsgraph", settings: LightmapSettings
) -> TexelSurface | None:
    """The texels of a mesh object: of its lightmap, or else of the one that the next bake would make of its UV map.

    None where it has neither.
    """
    evaluated = obj.evaluated_get(depsgraph)
    mesh = evaluated.data
    layer = mesh.uv_layers.get(obj.get(UV_MAP) or settings.uv_map or MADE_UV_MAP)
    if layer is None or not len(mesh.polygons):
        return None
    mesh.calc_loop_triangles()
    corners = np.empty((len(mesh.loop_triangles), 3), np.int32)
    mesh.loop_triangles.foreach_get("loops", corners.reshape(-1))
    local, uv = np.empty((len(mesh.vertices), 3), np.float32), np.empty((len(mesh.loops), 2), np.float32)
    mesh.vertices.foreach_get("co", local.reshape(-1))
    layer.uv.foreach_get("vector", uv.reshape(-1))
    position, at = local[corner_vertex(mesh)[corners]], uv[corners]
    linear = np.array(evaluated.matrix_world, np.float32)[:3, :3]
    area, flat = _areas(position @ linear.T), _areas(at)
    scale, offset = _image_of(obj, float(area.sum()), float(flat.sum()), settings)
    density = np.sqrt(flat * scale.prod() / np.maximum(area, np.float32(1e-30)))
    return TexelSurface(
        position.reshape(-1, 3),
        (at * scale + offset).reshape(-1, 2).astype(np.float32),
        np.repeat(density, 3).astype(np.float32),
    )


def _image_of(
    obj: "bpy.types.Object", area: float, flat: float, settings: LightmapSettings
) -> tuple[np.ndarray, np.ndarray]:
    """Scale and offset (2,) from an object's UV map to texels of its image."""
    image = lightmaps_by_file().get(obj[IMAGE]) if IMAGE in obj else None
    if image is not None:
        sx, sy, ox, oy = obj.get(SCALE_OFFSET, (1, 1, 0, 0))
        size = np.array(image.size, np.float32)
        return size * np.array([sx, sy], np.float32), size * np.array([ox, oy], np.float32)
    asked = settings.density * density_factor(obj)
    side = settings.size or min(whole_blocks(asked * sqrt(area / max(flat, 1e-30))), settings.max_size)
    return np.full(2, side, np.float32), np.zeros(2, np.float32)


def _areas(corners: np.ndarray) -> np.ndarray:
    """Of triangles (t, 3, d), (t,)."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    if corners.shape[2] == 2:
        return np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    return np.linalg.norm(np.cross(a, b), axis=1) / 2
