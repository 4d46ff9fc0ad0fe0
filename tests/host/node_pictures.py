"""Emission that nodes make of small pictures, as read and as Cycles bakes it."""

import bpy
import numpy as np
from photon_bake.addon.blender.read.materials import cycles_bake
from photon_bake.tests.host import scenes
from photon_bake.tests.host.test_extract_materials import quads

PICTURES = np.random.default_rng(7).uniform(0.02, 0.98, (3, 4, 4, 4))
PICTURES[..., 3] = 1
PICTURES[0, 0, 0, :3] = 0.5  # grey, black and white have rules of their own
PICTURES[1, 0, 1, :3] = 0
PICTURES[0, 0, 2, :3] = 0
PICTURES[1, 0, 3, :3] = 1


def emitter():
    material, surface = scenes.add_material("Emitter", "ShaderNodeEmission")
    return material, surface.inputs["Color"]


def picture(material, socket, which=0, alpha=None):
    """An image node of one of the pictures on a socket."""
    pixels = PICTURES[which].copy()
    if alpha is not None:
        pixels[..., 3] = alpha
    node = scenes.add_image_node(material, socket, pixels, byte=False)
    node.image.colorspace_settings.name = "Non-Color"
    return node


def emission_by_cycles(obj):
    """Cycles' bake of emission to an object's corners, (c, 3)."""
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 1
    obj.data.color_attributes.active_color = obj.data.color_attributes.new("Cycles", "FLOAT_COLOR", "CORNER")
    bpy.context.view_layer.update()
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.bake(type="EMIT", target="VERTEX_COLORS")
    values = np.empty(len(obj.data.loops) * 4, np.float32)
    obj.data.color_attributes["Cycles"].data.foreach_get("color", values)
    return values.reshape(-1, 4)[:, :3]


def emission_of_faces(scene):
    triangle, third = np.arange(0, scene.n_triangles, 2), np.full(scene.n_triangles // 2, 1 / 3, np.float32)
    return scene.look_up(scene.materials.emission, triangle, third, third)


def assert_as_cycles(material, varied=True, bakes=False):
    """At each texel of a 4 × 4 picture."""
    obj = quads(material)
    scene = scenes.extracted()
    assert bool(cycles_bake._baked) == bakes
    ours = emission_of_faces(scene)
    cycles = emission_by_cycles(obj).reshape(-1, 4, 3).mean(1)
    assert not varied or np.ptp(cycles) > 0.05
    poles = np.abs(cycles) > 1e5  # where rounding decides
    np.testing.assert_allclose(ours[~poles], cycles[~poles], atol=2e-3, rtol=5e-3)
