"""Where lightmaps' texels lie on objects, and how many there are a metre: for the viewport."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import sqrt

import bpy
import numpy as np

from ...receivers.uv_maps import areas, whole_blocks
from ...settings.lightmap import MADE_UV_MAP, LightmapSettings
from ..overrides import density_factor
from ..read.meshes.meshes import attribute, corner_vertex, triangle_corners
from .meshes import read_uv_map
from .writing import IMAGE, SCALE_OFFSET, UV_MAP


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
    obj: "bpy.types.Object",
    depsgraph: "bpy.types.Depsgraph",
    settings: LightmapSettings,
    images: "Mapping[str, bpy.types.Image]",
) -> TexelSurface | None:
    """The texels of a mesh object: of its lightmap, or else of the one that the next bake would make of its UV map.

    None where it has neither. `images` are `lightmaps_by_file`'s.
    """
    evaluated = obj.evaluated_get(depsgraph)
    mesh = evaluated.data
    uv = read_uv_map(mesh, obj.get(UV_MAP) or settings.uv_map or MADE_UV_MAP)
    if uv is None or not len(mesh.polygons):
        return None
    corners = triangle_corners(mesh)
    local = attribute(mesh, "position", "vector", (len(mesh.vertices), 3), np.float32)
    position, at = local[corner_vertex(mesh)[corners]], uv[corners]
    linear = np.array(evaluated.matrix_world, np.float32)[:3, :3]
    area, flat = areas(position @ linear.T), areas(at)
    image = images.get(obj.get(IMAGE, ""))
    scale, offset = _image_of(obj, image, float(area.sum()), float(flat.sum()), settings)
    density = np.sqrt(flat * scale.prod() / np.maximum(area, 1e-30))
    return TexelSurface(
        position.reshape(-1, 3),
        (at * scale + offset).reshape(-1, 2).astype(np.float32),
        np.repeat(density, 3).astype(np.float32),
    )


def _image_of(
    obj: "bpy.types.Object", image: "bpy.types.Image | None", area: float, flat: float, settings: LightmapSettings
) -> tuple[np.ndarray, np.ndarray]:
    """Scale and offset (2,) from an object's UV map to texels of its image."""
    if image is not None:
        sx, sy, ox, oy = obj.get(SCALE_OFFSET, (1, 1, 0, 0))
        size = np.array(image.size, np.float32)
        return size * np.array([sx, sy], np.float32), size * np.array([ox, oy], np.float32)
    asked = settings.density * density_factor(obj)
    side = settings.size or min(whole_blocks(asked * sqrt(area / max(flat, 1e-30))), settings.max_size)
    return np.full(2, side, np.float32), np.zeros(2, np.float32)
