"""Cancel the bake that runs."""

from typing import Any

import bpy

from ..addon.ui.state import bake_state


class PHOTON_BAKE_OT_cancel(bpy.types.Operator):
    """Stop the bake; the scene stays as it was"""

    bl_idname = "photon_bake.cancel"
    bl_label = "Cancel Bake"

    @classmethod
    def poll(cls, context: Any) -> bool:
        return bake_state.running

    def execute(self, context: Any) -> set[str]:
        bake_state.cancel()
        return {"FINISHED"}
