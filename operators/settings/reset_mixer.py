"""Reset Light Mixer."""

from typing import Any

import bpy

from ...addon.ui.properties.mixer import reset_layers


class PHOTON_BAKE_OT_reset_mixer(bpy.types.Operator):
    """Mix all light groups as they were baked: strength 1, white"""

    bl_idname = "photon_bake.reset_mixer"
    bl_label = "Reset Light Mixer"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: Any) -> set[str]:
        reset_layers(context.scene)
        return {"FINISHED"}
