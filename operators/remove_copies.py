"""Remove Baked Copies."""

from typing import Any

import bpy

from ..addon.blender.baked_copies import has_copies, remove_copies
from ..addon.ui.state import bake_state


class PHOTON_BAKE_OT_remove_copies(bpy.types.Operator):
    """Remove the copies that hold baked light, and show their originals in renders as before"""

    bl_idname = "photon_bake.remove_copies"
    bl_label = "Remove Baked Copies"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: Any) -> bool:
        if bake_state.running:
            cls.poll_message_set("A bake is running; wait for it or cancel it")
            return False
        if not has_copies():
            cls.poll_message_set("There are no baked copies")
            return False
        return True

    def execute(self, context: Any) -> set[str]:
        self.report({"INFO"}, f"Removed {remove_copies()} baked copies.")
        return {"FINISHED"}
