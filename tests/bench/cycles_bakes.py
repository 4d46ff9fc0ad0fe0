"""Cycles' own bakes, set to lose no light: as the design says truth is made."""

from time import perf_counter

import bpy
import numpy as np


def lose_no_light():
    """Bounces 32, no clamps, no adaptive sampling, no blurred gloss, on the CPU."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device, cycles.use_adaptive_sampling, cycles.use_light_tree = "CPU", False, True
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = 32
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True


def bake_indirect(obj, n_samples, seed=0, target="VERTEX_COLORS"):
    """Bake E/π of the indirect light to an object's active colour attribute or image; the call's seconds."""
    lose_no_light()
    bpy.context.scene.cycles.samples, bpy.context.scene.cycles.seed = n_samples, seed
    for other in bpy.context.view_layer.objects:
        other.select_set(other == obj)
    bpy.context.view_layer.objects.active = obj
    start = perf_counter()
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"INDIRECT"}, target=target, use_clear=True)
    return perf_counter() - start


def baked(obj):
    """The active colour attribute, (elements, 3) float32."""
    data = obj.data.color_attributes.active_color.data
    color = np.empty(len(data) * 4, np.float32)
    data.foreach_get("color", color)
    return color.reshape(-1, 4)[:, :3]
