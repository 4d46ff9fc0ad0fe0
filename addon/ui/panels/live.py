"""The switch of live light, what it shows, and how far its light has converged."""

from typing import Any

import bpy

from ..live import live_switch
from .tab import Section, draw_sentence


def draw_live(layout: Any, context: Any, width: int) -> None:
    """Draw them, sentences in lines of `width` characters."""
    row = layout.row(align=True)
    row.operator("photon_bake.live", icon="SHADING_SOLID" if not live_switch.on else "PAUSE", depress=live_switch.on)
    if live_switch.on:
        row.prop(context.window_manager, "photon_bake_live_mode", text="")
        draw_sentence(layout.column(align=True), live_switch.words, "BLANK1", width)
    elif live_switch.error:
        draw_sentence(layout.column(align=True), live_switch.error, "ERROR", width)


class PHOTON_BAKE_PT_live(Section, bpy.types.Panel):
    """How finely light is found; what is changed here counts when it is turned on next."""

    bl_label = "Live Light"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        column = self.layout.column()
        column.use_property_split, column.use_property_decorate = True, False
        column.enabled = not live_switch.on
        for name in ("n_vertices", "n_links", "n_bounces", "memory"):
            column.prop(context.scene.photon_bake.live, name)


def draw_in_view_menu(menu: Any, context: Any) -> None:
    """The same switch in the 3D View's View menu."""
    menu.layout.separator()
    menu.layout.operator("photon_bake.live", icon="CHECKBOX_HLT" if live_switch.on else "CHECKBOX_DEHLT")
