"""Live: turns live light on and off."""

from typing import Any

import bpy

from ..addon.ui.live import live_switch, sentence_of


class PHOTON_BAKE_OT_live(bpy.types.Operator):
    """Show direct and indirect light in 3D views in Solid shading, while the scene is edited; nothing is saved of it"""

    bl_idname = "photon_bake.live"
    bl_label = "Live Light"

    def execute(self, context: Any) -> set[str]:
        if live_switch.on:
            live_switch.turn_off()
            return {"FINISHED"}
        try:
            live_switch.turn_on(context.scene, context.view_layer)
        except Exception as error:
            live_switch.error = sentence_of(error)
            self.report({"ERROR"}, live_switch.error)
            return {"CANCELLED"}
        return {"FINISHED"}
