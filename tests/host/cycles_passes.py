"""Passes of a Cycles render, as arrays."""

import bpy
import numpy as np
import OpenEXR

PATH_LIMITS = ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces")


def render_passes(scene, path, samples=1, filter_width=1.5, bounces=32, pixel_filter="BLACKMAN_HARRIS"):
    """What Cycles renders into `path`, an EXR of many layers: channels (h, w) by name, the first row on top."""
    scene.render.engine, cycles = "CYCLES", scene.cycles
    cycles.samples, cycles.use_denoising, cycles.use_adaptive_sampling = samples, False, False
    cycles.pixel_filter_type, cycles.filter_width = pixel_filter, filter_width
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
    for limit in PATH_LIMITS:
        setattr(cycles, limit, bounces)
    cycles.transparent_max_bounces = 32  # lamps that are met count as such
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format, image.color_depth = "OPEN_EXR_MULTILAYER", "32"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = {name: c.pixels for part in file.parts for name, c in part.channels.items()}
    return {name.split(".", 1)[1]: np.array(pixels, np.float32) for name, pixels in channels.items()}
