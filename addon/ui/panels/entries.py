"""Where people look for a bake besides the tab: Render Properties > Bake, and the Render menu, which F3 searches."""

from typing import Any

import bpy

from ..state import bake_state
from .bake import draw_action, draw_targets
from .live import draw_in_view_menu
from .tab import settings_column


def draw_entry(layout: Any, context: Any) -> None:
    """The button and what it needs most; the rest is in the tab."""
    draw_action(layout)
    draw_targets(layout, context.scene.photon_bake)
    settings_column(layout).prop(context.scene.photon_bake, "quality")
    layout.label(text="All settings: 3D View > Sidebar (N) > Photon Bake", icon="INFO")


class PHOTON_BAKE_PT_render(bpy.types.Panel):
    """Bake from Render Properties, with another engine than Cycles, whose own Bake panel has it otherwise"""

    bl_label = "Photon Bake"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.engine != "CYCLES" or _cycles_panel() is None

    def draw(self, context: Any) -> None:
        draw_entry(self.layout, context)


def _cycles_panel() -> Any:
    """Cycles' own Bake panel; None while Cycles is disabled."""
    return getattr(bpy.types, "CYCLES_RENDER_PT_bake", None)


def _draw_in_cycles(panel: Any, context: Any) -> None:
    layout = panel.layout
    layout.separator()
    layout.use_property_split = False
    layout.label(text="Photon Bake", icon="LIGHT_SUN")
    draw_entry(layout, context)


def _draw_in_menu(menu: Any, context: Any) -> None:
    layout = menu.layout
    layout.separator()
    if bake_state.running:
        layout.operator("photon_bake.cancel", icon="X")
    else:
        layout.operator("photon_bake.bake_indirect", icon="LIGHT_SUN")


@bpy.app.handlers.persistent
def _enter_cycles(*_: Any) -> None:
    """Cycles may be enabled after us: it is looked for again when a file is opened."""
    panel = _cycles_panel()
    if panel is not None:
        panel.remove(_draw_in_cycles)
        panel.append(_draw_in_cycles)


def register() -> None:
    """Add the entries."""
    bpy.utils.register_class(PHOTON_BAKE_PT_render)
    bpy.types.TOPBAR_MT_render.append(_draw_in_menu)
    bpy.types.VIEW3D_MT_view.append(draw_in_view_menu)
    bpy.app.handlers.load_post.append(_enter_cycles)
    _enter_cycles()


def unregister() -> None:
    """Take them away again."""
    panel = _cycles_panel()
    if panel is not None:
        panel.remove(_draw_in_cycles)
    bpy.app.handlers.load_post.remove(_enter_cycles)
    bpy.types.VIEW3D_MT_view.remove(draw_in_view_menu)
    bpy.types.TOPBAR_MT_render.remove(_draw_in_menu)
    bpy.utils.unregister_class(PHOTON_BAKE_PT_render)
