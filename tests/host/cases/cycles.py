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


def cycles_mean(seed: int, into_image: bool = False) -> np.ndarray:
    """The mean of `cycles_light`, (3,)."""
    return cycles_light(seed, into_image).mean(axis=0, dtype=np.float64)


def cycles_light(seed: int, into_image: bool = False) -> np.ndarray:
    """Cycles' bake of the probes' corners, or of their texels, of the scene as it is, (c, 3) float32."""
    bpy.context.scene.cycles.seed = seed
    obj = bpy.data.objects["Probes"]
    if into_image:
        image = _image_of(obj)
    else:
        colors = obj.data.color_attributes
        colors.active_color = colors.get("Cycles") or colors.new("Cycles", "FLOAT_COLOR", "CORNER")
    bpy.context.view_layer.update()
    for other in bpy.context.view_layer.objects:
        other.select_set(other == obj)
    bpy.context.view_layer.objects.active = obj
    target = "IMAGE_TEXTURES" if into_image else "VERTEX_COLORS"
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"INDIRECT"}, target=target, margin=0)
    if into_image:
        values = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(values)
        values = values[values.reshape(-1, 4)[:, 3].repeat(4) > 0]
    else:
        values = np.empty(len(obj.data.loops) * 4, np.float32)
        obj.data.color_attributes["Cycles"].data.foreach_get("color", values)
    return values.reshape(-1, 4)[:, :3]


def _image_of(obj: "bpy.types.Object") -> "bpy.types.Image":
    """An image in which each probe, a triangle, fills as many texels as the others, that a bake goes into."""
    n, old = len(obj.data.polygons), bpy.data.images.get("Cycles")
    if old is not None:
        return old
    side = int(np.ceil(n**0.5))
    image = bpy.data.images.new("Cycles", 4 * side, 4 * side, alpha=True, float_buffer=True, is_data=True)
    column, row = np.arange(n) % side, np.arange(n) // side
    corners = np.array([[0.1, 0.1], [0.9, 0.1], [0.5, 0.9]])
    uvs = (np.stack([column, row], axis=1)[:, None] + corners) / side
    obj.data.uv_layers.new(name="Cycles", do_init=False).uv.foreach_set("vector", uvs.ravel())
    tree = obj.data.materials[0].node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    tree.nodes.active = node
    return image


def keep_light_group(name: str) -> None:
    """Hide the lamps outside a light group: Cycles' bake has no light groups of its own."""
    for obj in bpy.context.scene.objects:
        if obj.type == "LIGHT" and obj.lightgroup != name:
            obj.hide_render = True
