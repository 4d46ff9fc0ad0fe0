"""How much work a bake is, counted from what the file stores: modifiers' own numbers stand for what they make."""

from math import prod

import bpy
import numpy as np

from ...pipeline.estimates import Work
from ..read.meshes.meshes import count_triangles
from ..read.meshes.modifiers import active_modifiers
from .asked import Asked

_HARD_VERTICES = 1.5
"""Values a vertex where faces are flat: those of corners whose normals agree are one."""


def work_of(asked: Asked) -> Work:
    """The counts of a bake."""
    n_triangles = sum(_n_triangles(obj) for obj in asked.shown)
    n_receivers = n_texels = n_pixels = 0
    if "vertex" in asked.targets:
        n_receivers = int(sum(len(mesh.vertices) * _HARD_VERTICES for mesh in {obj.data for obj in asked.meshes}))
    if "lightmap" in asked.targets:
        n_texels = sum(_n_texels(obj, asked) for obj in asked.meshes)
        if asked.lightmap.size and asked.lightmap.atlas == "shared":
            n_texels = asked.lightmap.size**2
    if "camera" in asked.targets:
        render = asked.scene.render
        n_pixels = int(render.resolution_x * render.resolution_y * (render.resolution_percentage / 100) ** 2)
    return Work(n_triangles, n_receivers, n_texels, n_pixels)


def _n_triangles(obj: "bpy.types.Object") -> int:
    """Triangles that renders make of an object, or of what it instances, about."""
    if obj.type == "MESH":
        return int(count_triangles(obj.data) * prod(map(_factor, active_modifiers(obj, "RENDER"))))
    if obj.instance_type == "COLLECTION" and obj.instance_collection is not None:
        return sum(_n_triangles(one) for one in obj.instance_collection.all_objects if one.type == "MESH")
    return 0


def _factor(modifier: "bpy.types.Modifier") -> float:
    """How many times as many faces a modifier makes."""
    if modifier.type in {"SUBSURF", "MULTIRES"}:
        return float(4**modifier.render_levels)
    if modifier.type == "ARRAY":
        return float(modifier.count) if getattr(modifier, "fit_type", "") == "FIXED_COUNT" else 5.0
    if modifier.type == "MIRROR":
        return float(2 ** sum(modifier.use_axis))
    if modifier.type == "SOLIDIFY":
        return 2.0
    if modifier.type == "BEVEL":
        return 1.0 + 2.0 * modifier.segments
    return float(modifier.ratio) if modifier.type == "DECIMATE" and modifier.decimate_type == "COLLAPSE" else 1.0


def _n_texels(obj: "bpy.types.Object", asked: Asked) -> int:
    """Texels of an object's lightmap that are covered, about."""
    lightmap = asked.lightmap
    if lightmap.size:
        return lightmap.size**2
    scale = abs(obj.matrix_world.determinant()) ** (2 / 3)
    return int(min(_area(obj.data) * scale * lightmap.density**2, lightmap.max_size**2))


def _area(mesh: "bpy.types.Mesh") -> float:
    """The area of a stored mesh, from its bounding box where it has many faces."""
    n = len(mesh.polygons)
    if n == 0:
        return 0.0
    if n > 20_000:
        return float(np.mean([polygon.area for polygon in mesh.polygons[:: n // 500]])) * n
    areas = np.empty(n, np.float32)
    mesh.polygons.foreach_get("area", areas)
    return float(areas.sum())
