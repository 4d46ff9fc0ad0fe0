"""Add Preset, Remove Preset: the settings of a bake under a name of one's own."""

from typing import Any, ClassVar

import bpy
from bl_operators.presets import AddPresetBase

from ...addon.ui.panels.presets import SUBFOLDER, VALUES


class PHOTON_BAKE_OT_add_preset(AddPresetBase, bpy.types.Operator):
    """Keep these settings as a preset, or remove the preset"""

    bl_idname = "photon_bake.add_preset"
    bl_label = "Add Photon Bake Preset"
    preset_menu = "PHOTON_BAKE_PT_presets"
    preset_defines: ClassVar[list[Any]] = ["bake = bpy.context.scene.photon_bake"]
    preset_values: ClassVar[list[str]] = VALUES
    preset_subdir = SUBFOLDER
