"""Which light is baked."""

from typing import Any

import bpy

from .outputs.mixer import draw_light_groups
from .tab import Section, draw_knobs, settings_column


class PHOTON_BAKE_PT_light(Section, bpy.types.Panel):
    """Which light is baked."""

    bl_label = "Light"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        properties = context.scene.photon_bake
        column = settings_column(self.layout)
        draw_light_groups(column, context)
        column.prop(properties, "add_direct")
        column.prop(properties, "open_side")
        column.prop(properties, "normal_maps")
        draw_knobs(column, properties, "motion_blur")
