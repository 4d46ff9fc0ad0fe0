"""Bake, follow it, and what came out."""

from typing import Any

import bpy

from ..state import bake_state
from .live import draw_live
from .outcome import draw_outcome
from .outputs.mixer import draw_mixer
from .outputs.show import draw_baked_light, draw_pass
from .preflight import draw_preflight
from .presets import PHOTON_BAKE_PT_presets
from .tab import Tab, characters_in, settings_column


class PHOTON_BAKE_PT_bake(Tab, bpy.types.Panel):
    """Bake, follow it, and what came out."""

    bl_label = "Photon Bake"

    def draw_header_preset(self, context: Any) -> None:
        row = self.layout.row(align=True)
        row.operator("photon_bake.guide", text="", icon="HELP", emboss=False)
        PHOTON_BAKE_PT_presets.draw_panel_header(row)

    def draw(self, context: Any) -> None:
        properties = context.scene.photon_bake
        draw_action(self.layout)
        draw_live(self.layout, context, characters_in(context))
        draw_targets(self.layout, properties)
        column = settings_column(self.layout)
        column.prop(properties, "quality")
        row = column.row()
        row.active = properties.targets != {"camera"}
        row.prop(properties, "selected_only")
        draw_frames(column, context.scene)
        column.prop(properties, "strict")
        draw_baked_light(self.layout, context)
        draw_pass(self.layout, context)
        draw_mixer(self.layout, context)
        draw_preflight(self.layout, context, characters_in(context))
        draw_outcome(self.layout, context.scene, characters_in(context))


def draw_action(layout: Any) -> None:
    """The button, or how far the bake is."""
    column = layout.column()
    if not bake_state.running:
        column.scale_y = 1.6
        column.operator("photon_bake.bake_indirect", icon="LIGHT_SUN")
        return
    column.progress(factor=bake_state.fraction, text=bake_state.words)
    column.operator("photon_bake.cancel", text="Cancel (Esc)", icon="X")


def draw_targets(layout: Any, properties: Any) -> None:
    """What is baked to: two buttons a row, as three in one would be cut."""
    grid = layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
    grid.enabled = not bake_state.running
    grid.prop(properties, "targets", expand=True)  # a click chooses one, with Shift another too


def draw_frames(column: Any, scene: Any) -> None:
    """Whether frames are baked, and which: they are the scene's own, as for renders."""
    frames = scene.photon_bake.frames
    column.prop(frames, "use")
    if frames.use:
        row = column.row(align=True)
        for name in ("frame_start", "frame_end", "frame_step"):
            row.prop(scene, name, text="")
