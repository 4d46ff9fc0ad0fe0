"""Lightmaps into Blender's data: UV maps, properties of objects, images."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import bpy

from ...lightmap_settings import LightmapSettings
from .images import load_lightmaps
from .layout import Layout
from .meshes import write_uv_map

IMAGE, UV_MAP, SCALE_OFFSET = "lightmap_image", "lightmap_uv_map", "lightmap_scale_offset"
"""Custom properties of objects: name of the image's file, name of the UV map, and (sx, sy, ox, oy): what the UV map
has at (u, v) is in the image at (sx u + ox, sy v + oy)."""


def write_lightmaps(
    layout: Layout,
    objects: "Sequence[bpy.types.Object | None]",
    paths: Mapping[int, Path],
    settings: LightmapSettings,
) -> None:
    """Write the layout's UV maps and places to meshes and objects, and load the images' files.

    Parameters
    ----------
    layout : Layout
    objects : sequence of bpy.types.Object or None
        The object of each place, with its mesh as it was before the bake; None where it takes no light.
    paths : dict of int to Path
        Files by image. The objects of other images stay as they are.
    settings : LightmapSettings
    """
    taking = [(place, obj) for place, obj in zip(layout.places, objects, strict=True) if obj and place.image in paths]
    for name, mesh in {place.mesh_name: obj.data for place, obj in taking}.items():
        if name in layout.made:
            write_uv_map(mesh, layout.uv_map, layout.made[name])
    for place, obj in taking:
        if obj.is_editable:  # one that is linked keeps its own
            obj[IMAGE] = paths[place.image].name
            obj[UV_MAP] = layout.uv_map
            obj[SCALE_OFFSET] = place.scale_offset
    load_lightmaps(list(paths.values()), [layout.names[image] for image in paths], settings)
