"""Presets of one's own, in the header of the tab: settings of a bake, without names and folders."""

import bpy
from bl_ui.utils import PresetPanel

from ..properties.scene import CAMERA_KNOBS, KNOBS, LIGHTMAP_KNOBS, PROBE_KNOBS

SUBFOLDER = "photon_bake"
"""Of Blender's folder of presets."""

_NAMES = {"uv_map", "file_name"}
"""Knobs that say nothing for another scene."""

VALUES = [
    "bake.targets",
    *(f"bake.{knob.name}" for knob in KNOBS),
    *(f"bake.lightmap.{knob.name}" for knob in LIGHTMAP_KNOBS if knob.name not in _NAMES),
    *(f"bake.camera.{knob.name}" for knob in CAMERA_KNOBS if knob.name not in _NAMES),
    *(f"bake.probes.{knob.name}" for knob in PROBE_KNOBS if knob.name not in _NAMES),
    "bake.bake_copies",
    "bake.fit",
    "bake.strict",
]
"""What a preset keeps of ``scene.photon_bake``."""


class PHOTON_BAKE_PT_presets(PresetPanel, bpy.types.Panel):
    """The presets that there are, and a field to add one"""

    bl_label = "Photon Bake Presets"
    preset_subdir = SUBFOLDER
    preset_operator = "script.execute_preset"
    preset_add_operator = "photon_bake.add_preset"
