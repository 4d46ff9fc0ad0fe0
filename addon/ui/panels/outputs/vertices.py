"""Light on vertices: where it is written, and what is done with it."""

from typing import Any

import bpy

from ....blender.playback import has_playback
from ..tab import TargetSection, settings_column


class PHOTON_BAKE_PT_vertices(TargetSection, bpy.types.Panel):
    """Where light on vertices is written, and what is done with it."""

    bl_label = "Vertices"
    target = "vertex"

    def draw(self, context: Any) -> None:
        properties = context.scene.photon_bake
        column = settings_column(self.layout)
        column.prop(properties, "attribute")
        row = column.row(align=True)
        row.prop(properties, "bake_copies")
        row.operator("photon_bake.remove_copies", text="", icon="X")
        draw_playback(column, context.scene)
        column.prop(properties, "fit")
        column.prop(properties, "denoise")


def draw_playback(column: Any, scene: Any) -> None:
    """How light of several frames is kept, and the way out of its playback."""
    frames = scene.photon_bake.frames
    if frames.use:
        column.prop(frames, "keeping")
        if frames.keeping == "texture":
            column.prop(frames, "folder")
    if has_playback(scene.objects):
        column.operator("photon_bake.remove_playback", icon="X")
