"""Remove Playback."""

from typing import Any

import bpy

from ..addon.blender.playback import has_playback, remove_playback
from .jobs.solving import NotWhileBaking


class PHOTON_BAKE_OT_remove_playback(NotWhileBaking, bpy.types.Operator):
    """Remove the modifiers that play light of frames back on vertices; their images' files stay"""

    bl_idname = "photon_bake.remove_playback"
    bl_label = "Remove Playback"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def _lacking(cls, context: Any) -> str:
        return "" if has_playback(bpy.data.objects) else "No object plays light back"

    def execute(self, context: Any) -> set[str]:
        self.report({"INFO"}, f"Removed the playback of {remove_playback()} objects.")
        return {"FINISHED"}
