"""Folders for files: where the panel says, or, in a file that was never saved, where somebody is asked to choose."""

from pathlib import Path
from typing import Any

import bpy

from ..addon.errors import BakeError


def path_of(folder: str, what_has: str) -> Path:
    """A folder that the panel names, as a path.

    Raises
    ------
    BakeError
        If it is beside a file that was never saved.
    """
    if nowhere(folder):
        raise BakeError(f"The file was never saved, so {what_has} no folder: save it, or choose a Folder.")
    return Path(bpy.path.abspath(folder))


def nowhere(folder: str) -> bool:
    """Whether a folder is beside a file that was never saved."""
    return folder.startswith("//") and not bpy.data.filepath


def without_folder(properties: Any) -> list[Any]:
    """The settings of those targets whose folder is beside a file that was never saved."""
    of_target = {"lightmap": properties.lightmap, "camera": properties.camera, "probes": properties.probes}
    return [of for target, of in of_target.items() if target in properties.targets and nowhere(of.folder)]


class PHOTON_BAKE_OT_choose_folder(bpy.types.Operator):
    """Choose the folder that files go to, since this file was never saved, and go on"""

    bl_idname = "photon_bake.choose_folder"
    bl_label = "Choose Folder"
    bl_options = {"INTERNAL"}

    __annotations__ = {
        "directory": bpy.props.StringProperty(subtype="DIR_PATH", options={"SKIP_SAVE"}),
        "filter_folder": bpy.props.BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"}),
        "for_pass": bpy.props.BoolProperty(default=False, options={"HIDDEN", "SKIP_SAVE"}),
        "copies": bpy.props.BoolProperty(default=False, options={"HIDDEN", "SKIP_SAVE"}),
    }

    def invoke(self, context: Any, event: Any) -> set[str]:
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: Any) -> set[str]:
        properties = context.scene.photon_bake
        for of_target in [properties.camera] if self.for_pass else without_folder(properties):
            of_target.folder = self.directory
        if self.for_pass:
            bpy.ops.photon_bake.add_pass("INVOKE_DEFAULT")
        else:
            bpy.ops.photon_bake.bake_indirect("INVOKE_DEFAULT", copies=self.copies)
        return {"FINISHED"}
