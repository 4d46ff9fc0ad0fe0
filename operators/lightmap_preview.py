"""Show Lightmaps, Hide Lightmaps: the result in materials, and out of them again."""

from typing import Any

import bpy

from ..addon.blender.lightmap_preview import hide_lightmaps, show_lightmaps


class PHOTON_BAKE_OT_show_lightmaps(bpy.types.Operator):
    """Add base colour times lightmap to the diffuse shaders of all materials, to be seen under direct light alone"""

    bl_idname = "photon_bake.show_lightmaps"
    bl_label = "Show Lightmaps"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: Any) -> set[str]:
        for warning in show_lightmaps(context.scene.objects):
            self.report({"WARNING"}, warning)
        return {"FINISHED"}


class PHOTON_BAKE_OT_hide_lightmaps(bpy.types.Operator):
    """Take the lightmaps out of all materials again"""

    bl_idname = "photon_bake.hide_lightmaps"
    bl_label = "Hide Lightmaps"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: Any) -> set[str]:
        hide_lightmaps()
        return {"FINISHED"}
