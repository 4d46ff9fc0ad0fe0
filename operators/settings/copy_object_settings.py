"""Copy to Selected: the active object's settings for all selected ones."""

from typing import Any

import bpy

from ...addon.ui.properties.objects import settings_of
from ..jobs.solving import NotWhileBaking


class PHOTON_BAKE_OT_copy_object_settings(NotWhileBaking, bpy.types.Operator):
    """Copy the active object's Photon Bake settings to all selected objects"""

    bl_idname = "photon_bake.copy_object_settings"
    bl_label = "Copy to Selected"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def _lacking(cls, context: Any) -> str:
        if context.object is None or not any(obj != context.object for obj in context.selected_objects):
            return "Select other objects too: the active one's settings are copied to them"
        return ""

    def execute(self, context: Any) -> set[str]:
        values = settings_of(context.object)
        others = [obj for obj in context.selected_objects if obj != context.object]
        editable = [obj for obj in others if obj.is_editable]
        for obj in editable:
            for name, value in values.items():
                setattr(obj.photon_bake, name, value)
        self.report({"INFO"}, f"Copied settings to {len(editable)} objects.")
        if len(editable) < len(others):
            n = len(others) - len(editable)
            self.report({"WARNING"}, f"{n} objects are linked and keep theirs: make library overrides of them.")
        return {"FINISHED"}
