"""Lightmaps into Blender's data: UV maps, properties of objects, images."""

from collections.abc import Sequence
from pathlib import Path

import bpy

from ..errors import BakeError
from ..lightmap_settings import LightmapSettings
from .lightmap_images import load_lightmaps
from .lightmap_layout import Layout
from .lightmap_meshes import write_uv_map

IMAGE, UV_MAP, SCALE_OFFSET = "lightmap_image", "lightmap_uv_map", "lightmap_scale_offset"
"""Custom properties of objects: name of the image's file, name of the UV map, and (sx, sy, ox, oy): what the UV map
has at (u, v) is in the image at (sx u + ox, sy v + oy)."""


def check_unchanged(layout: Layout) -> None:
    """Make sure that objects and meshes are as they were before the bake.

    Raises
    ------
    BakeError
        If not, naming the object.
    """
    for place in layout.places:
        obj = bpy.data.objects.get(place.object_name)
        if obj is None:
            raise BakeError(f"Object '{place.object_name}' is gone or was renamed during the bake: bake again.")
        made = layout.made.get(place.mesh_name)
        if obj.data.name != place.mesh_name or (made is not None and len(made) != len(obj.data.loops)):
            raise BakeError(f"The mesh of object '{place.object_name}' was changed during the bake: bake again.")
        if obj.mode == "EDIT":
            raise BakeError(f"Object '{place.object_name}' is in edit mode: leave edit mode and bake again.")


def write_lightmaps(layout: Layout, paths: Sequence[Path], settings: LightmapSettings) -> None:
    """Write the layout's UV maps and places to meshes and objects, and load the images' files.

    Raises
    ------
    BakeError
        If an object or a mesh is not as it was before the bake; nothing was written then.
    """
    check_unchanged(layout)
    for name, uv in layout.made.items():
        write_uv_map(bpy.data.meshes[name], layout.uv_map, uv)
    for place in layout.places:
        obj = bpy.data.objects[place.object_name]
        if obj.is_editable:  # one that is linked keeps its own
            obj[IMAGE] = paths[place.image].name
            obj[UV_MAP] = layout.uv_map
            obj[SCALE_OFFSET] = place.scale_offset
    load_lightmaps(paths, layout.names, settings)
