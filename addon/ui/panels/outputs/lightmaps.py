"""Lightmaps: how they are laid out and written, and what is done with them."""

from typing import Any

import bpy

from ..tab import TargetSection, draw_knobs, settings_column
from .show import draw_remove_lightmaps


class PHOTON_BAKE_PT_lightmaps(TargetSection, bpy.types.Panel):
    """How lightmaps are laid out and written, and what is done with them."""

    bl_label = "Lightmaps"
    target = "lightmap"

    def draw(self, context: Any) -> None:
        lightmap = context.scene.photon_bake.lightmap
        column = settings_column(self.layout)
        column.prop(lightmap, "folder")
        column.prop(lightmap, "atlas")
        draw_knobs(column, lightmap, "size")
        if not lightmap.size:
            draw_knobs(column, lightmap, "density", "max_size")
        _draw_uv_map(column, lightmap, context.object)
        if not lightmap.uv_map:
            column.prop(lightmap, "padding")
        column.prop(lightmap, "file_format")
        if lightmap.file_format in {"rgbm", "rgbd"}:
            column.prop(lightmap, "value_range")
        column.prop(lightmap, "denoiser")
        column.prop(lightmap, "directional")
        self.layout.operator("photon_bake.export_gltf", icon="EXPORT")
        draw_remove_lightmaps(self.layout, context)


def _draw_uv_map(column: Any, lightmap: Any, obj: "bpy.types.Object | None") -> None:
    """The name of a UV map, to be found among those of the active object."""
    if obj is not None and obj.type == "MESH":
        column.prop_search(lightmap, "uv_map", obj.data, "uv_layers")
    else:
        column.prop(lightmap, "uv_map")
