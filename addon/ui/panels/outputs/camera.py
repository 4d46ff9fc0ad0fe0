"""The camera's pass: how it is sampled and written."""

from typing import Any

import bpy

from ..tab import TargetSection, draw_knobs, settings_column


class PHOTON_BAKE_PT_camera(TargetSection, bpy.types.Panel):
    """How the camera's pass is sampled and written."""

    bl_label = "Camera"
    target = "camera"

    def draw(self, context: Any) -> None:
        camera = context.scene.photon_bake.camera
        column = settings_column(self.layout)
        draw_knobs(column, camera, "folder", "file_name", "n_pixel_samples", "n_gloss_rays", "n_media_rays")
        draw_knobs(column, camera, "pass_denoiser", "precision", "compression")
