"""Probes: where they lie, and how they are lit and written."""

from typing import Any

import bpy

from ..tab import TargetSection, draw_knobs, settings_column


class PHOTON_BAKE_PT_probes(TargetSection, bpy.types.Panel):
    """Where probes lie, and how they are lit and written."""

    bl_label = "Probes"
    target = "probes"

    def draw(self, context: Any) -> None:
        probes = context.scene.photon_bake.probes
        column = settings_column(self.layout)
        draw_knobs(column, probes, "folder", "place", "spacing", "max_probes", "n_probe_rays", "harmonics", "axes")
