"""The picture of docs/light_mixer.md: one bake of the demo room with a lamp in it, mixed twice.

.venv/bin/python tests/bench/mixer_pictures.py --pictures docs/images
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np
import photon_bake
from figures import ROOT, scene_options
from photon_bake.addon.output.png import write_png

SIZE, SAMPLES = (480, 360), 64
EVENING = {"Sun": (0.0, (1, 1, 1)), "Sky": (0.2, (0.5, 0.65, 1)), "Lamp": (3.0, (1, 1, 1))}
"""Strength and color of each group."""


def demo_room(path):
    """The demo scene with a lamp, each of its lights in a group of its own."""
    subprocess.run([sys.executable, ROOT / "tools/demo_scene.py", "build", path], check=True)
    bpy.ops.wm.open_mainfile(filepath=str(path))
    lamp = bpy.data.lights.new("Lamp", "POINT")
    lamp.energy, lamp.color, lamp.shadow_soft_size = 8.0, (1.0, 0.6, 0.3), 0.12
    obj = bpy.data.objects.new("Lamp", lamp)
    obj.location = (3.2, 4.2, 2.2)
    scene = bpy.context.scene
    scene.collection.objects.link(obj)
    for name in EVENING:
        bpy.context.view_layer.lightgroups.add(name=name)
    bpy.data.objects["Sun"].lightgroup, scene.world.lightgroup, obj.lightgroup = EVENING
    return scene


def rendered(scene, path):
    """What Cycles makes, as screens show it, (h, w, 3) uint8."""
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path))
    pixels = np.empty(SIZE[0] * SIZE[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return (255 * pixels.reshape(SIZE[1], SIZE[0], 4)[::-1, :, :3] + 0.5).astype(np.uint8)


def pictures(folder):
    """As it was baked, and in the evening, side by side."""
    scene = demo_room(folder / "demo.blend")
    properties = scene.photon_bake
    properties.quality, properties.light_groups = "medium", "apart"
    bpy.ops.photon_bake.bake_indirect()
    bpy.ops.photon_bake.use_baked_light()
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.cycles.samples, scene.render.image_settings.file_format = SAMPLES, "PNG"
    found = [rendered(scene, folder / "baked.png")]
    for name, (strength, color) in EVENING.items():
        properties.mixer[name].strength, properties.mixer[name].color = strength, color
    for name in ("Sun", "Lamp"):  # direct light is theirs
        bpy.data.lights[name].energy *= EVENING[name][0]
    sky, (strength, color) = scene.world.node_tree.nodes["Background"].inputs, EVENING["Sky"]
    sky["Strength"].default_value *= strength
    sky["Color"].default_value = (*np.multiply(sky["Color"].default_value[:3], color), 1)
    return np.concatenate([*found, rendered(scene, folder / "evening.png")], axis=1)


if __name__ == "__main__":
    given = scene_options(__doc__).parse_args()
    photon_bake.register()
    with tempfile.TemporaryDirectory() as room:
        write_png(given.pictures / "light_mixer.png", pictures(Path(room)))
    os._exit(0)
