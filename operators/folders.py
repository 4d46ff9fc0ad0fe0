"""Folders that files are written to, as the panel names them; and Choose Folder, which asks for one."""

from pathlib import Path
from typing import Any

import bpy

from ..addon.errors import BakeError

_OF_TARGET = {"lightmap": "lightmap", "camera": "camera"}
"""Which of the panel's properties have the folder of a target."""


def folder_of(properties: Any, what_has: str) -> Path:
    """The folder of properties that have one, as a path.

    Raises
    ------
    BakeError
        If it is to lie beside a .blend file that is not there yet.
    """
    if _is_nowhere(properties):
        raise BakeError(f"The file was never saved, so {what_has} no folder: save it, or choose a Folder.")
    return Path(bpy.path.abspath(properties.folder))


def wants_folder(properties: Any) -> list[Any]:
    """What of the panel's properties has no folder, though something is baked into it."""
    wanted = [getattr(properties, name) for target, name in _OF_TARGET.items() if target in properties.targets]
    return [one for one in wanted if _is_nowhere(one)]


def _is_nowhere(properties: Any) -> bool:
    return bool(properties.folder.startswith("//") and not bpy.data.filepath)


class PHOTON_BAKE_OT_choose_folder(bpy.types.Operator):
    """Choose where files go, as this file was never saved, and bake"""

    bl_idname = "photon_bake.choose_folder"
    bl_label = "Bake into Folder"
    bl_options = {"INTERNAL"}

    __annotations__ = {
        "directory": bpy.props.StringProperty(name="Folder", subtype="DIR_PATH", options={"SKIP_SAVE"}),
        "filter_folder": bpy.props.BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"}),
        "copies": bpy.props.BoolProperty(options={"HIDDEN", "SKIP_SAVE"}),
    }

    def invoke(self, context: Any, event: Any) -> set[str]:
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: Any) -> set[str]:
        for one in wants_folder(context.scene.photon_bake):
            one.folder = self.directory
        return set(bpy.ops.photon_bake.bake_indirect("INVOKE_DEFAULT", copies=self.copies))
