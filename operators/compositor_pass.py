"""Add Pass, Remove Pass: the camera's indirect light in the compositor, and out of it again."""

from pathlib import Path
from typing import Any

import bpy

from ..addon.blender.compositor import add_pass, remove_pass
from ..addon.errors import BakeError
from ..addon.output.camera import frame_path


class PHOTON_BAKE_OT_add_pass(bpy.types.Operator):
    """Compose the camera's pass with renders, and have Cycles render direct light alone"""

    bl_idname = "photon_bake.add_pass"
    bl_label = "Add to Compositor"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: Any) -> set[str]:
        try:
            add_pass(context.scene, pass_files(context.scene))
        except BakeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class PHOTON_BAKE_OT_remove_pass(bpy.types.Operator):
    """Take the camera's pass out of the compositor, and set Cycles' bounces back"""

    bl_idname = "photon_bake.remove_pass"
    bl_label = "Remove from Compositor"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: Any) -> set[str]:
        if not remove_pass(context.scene):
            self.report({"INFO"}, "The compositor has no pass of Photon Bake's.")
        return {"FINISHED"}


def pass_files(scene: Any) -> list[Path]:
    """The files that the panel's folder has: those of the scene's frames from the first on, or the current one's."""
    settings = scene.photon_bake.camera
    folder = Path(bpy.path.abspath(settings.folder))
    frames = range(scene.frame_start, scene.frame_end + 1)
    paths = [frame_path(folder, settings.file_name, frame) for frame in frames]
    there = [path for path in paths if path.is_file()]
    if len(there) > 1:
        return there
    return [frame_path(folder, settings.file_name, scene.frame_current)]
