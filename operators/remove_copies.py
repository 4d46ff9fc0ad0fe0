"""Remove Baked Copies."""

from typing import Any

import bpy

from ..addon.blender.write.baked_copies import has_copies, remove_copies
from .jobs.solving import NotWhileBaking


class PHOTON_BAKE_OT_remove_copies(NotWhileBaking, bpy.types.Operator):
    """Remove the copies that hold baked light, and show their originals in renders as before"""

    bl_idname = "photon_bake.remove_copies"
    bl_label = "Remove Baked Copies"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def _lacking(cls, context: Any) -> str:
        return "" if has_copies() else "There are no baked copies"

    def execute(self, context: Any) -> set[str]:
        self.report({"INFO"}, f"Removed {remove_copies()} baked copies.")
        return {"FINISHED"}
