"""What Cycles says of the light at the probes."""

import bpy
import numpy as np


def set_cycles(samples: int) -> None:
    """Cycles as it tells the truth: every bounce, nothing clamped."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.use_adaptive_sampling = "CPU", samples, False
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = 32
    cycles.transparent_max_bounces = 32
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True


def cycles_mean(seed: int) -> np.ndarray:
    """The mean of `cycles_light`, (3,)."""
    return cycles_light(seed).mean(axis=0, dtype=np.float64)


def cycles_light(seed: int) -> np.ndarray:
    """Cycles' bake of the probes' corners of the scene as it is, (c, 3) float32."""
    bpy.context.scene.cycles.seed = seed
    obj = bpy.data.objects["Probes"]
    colors = obj.data.color_attributes
    attribute = colors.get("Cycles") or colors.new("Cycles", "FLOAT_COLOR", "CORNER")
    colors.active_color = attribute
    bpy.context.view_layer.update()
    for other in bpy.context.view_layer.objects:
        other.select_set(other == obj)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"INDIRECT"}, target="VERTEX_COLORS")
    values = np.empty(len(obj.data.loops) * 4, np.float32)
    obj.data.color_attributes["Cycles"].data.foreach_get("color", values)
    return values.reshape(-1, 4)[:, :3]


def keep_light_group(name: str) -> None:
    """Hide the lamps outside a light group: Cycles' bake has no light groups of its own."""
    for obj in bpy.context.scene.objects:
        if obj.type == "LIGHT" and obj.lightgroup != name:
            obj.hide_render = True
