"""Renders baked light by EEVEE and by Cycles in a Blender with a window: `eevee.py` runs it.

    blender --factory-startup --python tests/bench/eevee_window.py -- FOLDER

Prints a line "eevee: " with JSON: the light that 40 objects with a lightmap each show, which share one material, over
what is in their images, for each engine; and the demo's mean color by both. FOLDER gets the pictures. Needs the
extension's libraries in Blender's Python, as `python tools/install_zip.py --tests BLENDER` lays them out.
"""

import importlib.util
import json
import os
import sys
import traceback
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / ".venv" / "src"), str(ROOT)]

import photon_bake  # noqa: E402
from photon_bake.addon.blender.show import use_baked_light  # noqa: E402
from photon_bake.addon.output.lightmap import write_lightmap  # noqa: E402

from tests.host.scenes import add_lamp, add_material, add_plane  # noqa: E402

ENGINES = {"Cycles": "CYCLES", "EEVEE": "BLENDER_EEVEE" if bpy.app.version >= (5, 0, 0) else "BLENDER_EEVEE_NEXT"}
N_OBJECTS, CELL = 40, 12


def render(path, engine, size, samples):
    """What an engine makes, linear (h, w, 3), rows from the bottom."""
    scene = bpy.context.scene
    render, cycles = scene.render, scene.cycles
    render.engine, render.filepath = ENGINES[engine], str(path)
    render.resolution_x, render.resolution_y, render.resolution_percentage = *size, 100
    cycles.device, cycles.samples, cycles.use_denoising = "CPU", samples, False
    scene.eevee.taa_render_samples = samples
    image = render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "IMAGE"
    image.file_format, image.color_depth = "OPEN_EXR", "32"
    bpy.ops.render.render(write_still=True)
    picture = bpy.data.images.load(str(path))
    pixels = np.empty(size[0] * size[1] * 4, np.float32)
    picture.pixels.foreach_get(pixels)
    bpy.data.images.remove(picture)
    return pixels.reshape(size[1], size[0], 4)[..., :3]


def bake(**settings):
    """A quick bake by the operator."""
    properties = bpy.context.scene.photon_bake
    properties.quality = "draft"
    for name, value in settings.items():
        owner = properties.lightmap if hasattr(properties.lightmap, name) else properties
        setattr(owner, name, value)
    assert bpy.ops.photon_bake.bake_indirect() == {"FINISHED"}


def forty_objects(folder):
    """Light shown over light in the image, of each object and by each engine: 1 is right."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    material, shader = add_material()
    shader.inputs["Base Color"].default_value = (1, 1, 1, 1)
    planes = [add_plane(f"Plane {i}", size=1.0, material=material) for i in range(N_OBJECTS)]
    for i, plane in enumerate(planes):
        plane.location = (i % 8 + 0.5, i // 8 + 0.5, 0)
    add_lamp("POINT", location=(4, 2, 4))
    bake(targets={"lightmap"}, atlas="per_object", folder=str(folder), n_photons=2000, gather="density", density=8.0)
    bpy.data.objects.remove(bpy.data.objects["Lamp"])
    value = (np.arange(N_OBJECTS) + 1) / 64
    for i, plane in enumerate(planes):
        image = bpy.data.images[f"Photon Bake {plane.name}"]
        texels = np.full((image.size[1], image.size[0], 3), value[i], np.float32)
        path = Path(bpy.path.abspath(image.filepath))
        write_lightmap(path, texels, image["lightmap_encoding"], image["lightmap_range"])
        image.reload()
    use_baked_light(bpy.context.scene)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 8.0, (4, 2.5, 5)
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    shown = {}
    for engine in ENGINES:
        pixels = render(folder / f"forty_{engine}.exr", engine, (8 * CELL, 5 * CELL), 16)
        cells = pixels.reshape(5, CELL, 8, CELL, 3)[:, 3:-3, :, 3:-3].mean(axis=(1, 3, 4)).reshape(-1)
        shown[engine] = (cells / value).tolist()
    return shown


def demo(folder):
    """The demo's mean color, with light baked to vertices by both engines, and with Cycles' own bounces."""
    spec = importlib.util.spec_from_file_location("demo_scene", ROOT / "tools/demo_scene.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.build(str(folder / "demo.blend"))
    cycles, size = bpy.context.scene.cycles, (240, 180)
    cycles.max_bounces = cycles.diffuse_bounces = 32
    pictures = {"Cycles, 32 bounces": render(folder / "demo_bounces.exr", "Cycles", size, 64)}
    bake(targets={"vertex"})
    use_baked_light(bpy.context.scene)
    for engine in ENGINES:
        pictures[f"{engine}, baked light"] = render(folder / f"demo_{engine}.exr", engine, size, 16)
    return {name: picture.mean(axis=(0, 1)).tolist() for name, picture in pictures.items()}


def main():
    """Measure from Blender's timer, when there is a window, and leave."""
    folder, status = Path(sys.argv[sys.argv.index("--") + 1]), 1
    try:
        photon_bake.register()
        print("eevee:", json.dumps({"forty": forty_objects(folder), "demo": demo(folder)}))
        status = 0
    except BaseException:
        traceback.print_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


bpy.app.timers.register(main, first_interval=1.0)
