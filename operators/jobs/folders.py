"""Folders for files, chosen where a file was never saved, and what files are named by."""

from pathlib import Path
from typing import Any

import bpy

from ...addon.core.errors import BakeError


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
    if properties.frames.use and properties.frames.keeping == "texture":
        of_target["vertex"] = properties.frames
    return [of for target, of in of_target.items() if target in properties.targets and nowhere(of.folder)]


def check_folder(folder: Path, what: str) -> None:
    """Find out before the work whether a folder can be made for files.

    Raises
    ------
    BakeError
        If something else has its name.
    """
    if folder.exists() and not folder.is_dir():
        raise BakeError(f"{folder} is a file; give a folder for {what}.")


def make_folder(folder: Path) -> None:
    """Make a folder for files where it is missing.

    Raises
    ------
    BakeError
        If it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BakeError(f"The folder {folder} cannot be made ({error.strerror}).") from error


def scene_name(scene: Any) -> str:
    """What the files of a scene are named by: the .blend file, or the scene itself in one that was never saved."""
    return Path(bpy.data.filepath).stem or str(scene.name)


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
