"""Use Baked Light, Stop Using Baked Light, Remove Lightmaps: the result in materials, and out of the file again."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

from ..addon.blender.show import is_shown, leave_baked_light, remove_lightmaps
from ..addon.core.errors import BakeError
from ..addon.ui.properties.show import show_baked_light
from ..addon.ui.staleness import own_changes
from .jobs.solving import NotWhileBaking


class PHOTON_BAKE_OT_use_baked_light(NotWhileBaking, bpy.types.Operator):
    """Add base color times baked light to all materials, and turn off the bounces that it replaces"""

    bl_idname = "photon_bake.use_baked_light"
    bl_label = "Use Baked Light"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: Any) -> set[str]:
        try:
            for warning in show_baked_light(context.scene):
                self.report({"WARNING"}, warning)
        except BakeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class PHOTON_BAKE_OT_leave_baked_light(NotWhileBaking, bpy.types.Operator):
    """Take baked light out of all materials, and set bounces back to what they were"""

    bl_idname = "photon_bake.leave_baked_light"
    bl_label = "Stop Using Baked Light"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: Any) -> set[str]:
        with own_changes():
            leave_baked_light()
        return {"FINISHED"}


class PHOTON_BAKE_OT_remove_lightmaps(NotWhileBaking, bpy.types.Operator):
    """Remove the images of lightmaps, the UV maps that were made for them and all that objects know of them"""

    bl_idname = "photon_bake.remove_lightmaps"
    bl_label = "Remove Lightmaps"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = {
        "files": bpy.props.BoolProperty(
            name="Delete Files",
            description="Delete the images' files too, which Undo does not bring back",
            default=False,
            options={"SKIP_SAVE"},
        )
    }

    def invoke(self, context: Any, event: Any) -> set[str]:
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context: Any) -> set[str]:
        shown = [scene for scene in bpy.data.scenes if is_shown(scene)]
        leave_baked_light()
        n_images, failures = remove_lightmaps(self.files)
        for scene in shown:
            show_if_any(scene)
        for failure in failures:
            self.report({"WARNING"}, failure)
        self.report({"INFO"}, f"Removed {n_images} lightmaps." if n_images else "There are no lightmaps.")
        return {"FINISHED"}


def show_if_any(scene: Any) -> list[str]:
    """Show a scene's baked light if it has any; returns warnings."""
    try:
        return show_baked_light(scene)
    except BakeError:
        return []


def shown_after_bake(scene: Any, asked: bool) -> list[str]:
    """Show what a bake has written, if that is asked for or the scene showed light before; returns warnings."""
    return show_if_any(scene) if asked or is_shown(scene) else []


@contextmanager
def baked_light_left(scenes: Any) -> Iterator[None]:
    """Without baked light in materials, for a while."""
    shown = [scene for scene in scenes if is_shown(scene)]
    if shown:
        leave_baked_light()
    try:
        yield
    finally:
        for scene in shown:
            show_if_any(scene)


CLASSES = (
    PHOTON_BAKE_OT_use_baked_light,
    PHOTON_BAKE_OT_leave_baked_light,
    PHOTON_BAKE_OT_remove_lightmaps,
)
