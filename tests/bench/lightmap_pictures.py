"""Makes the pictures of lightmaps in the docs: the Cornell box by Cycles, by its lightmaps, and the lightmaps.

python tests/bench/lightmap_pictures.py --pictures DIR [--scenes DIR]
"""

import tempfile
from pathlib import Path

import bpy
import numpy as np
from figures import scene_options, write_png
from photon_bake.addon.blender.show import use_baked_light
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.output.lightmap import contact_sheet
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.settings.lightmap import LightmapSettings
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.lightmap import LightmapRequest

SIDE, GAP = 360, 8
SAMPLES = 64


def rendered(folder, name, bounces):
    """Cycles' picture of the scene, (SIDE, SIDE, 3), row 0 at the top."""
    scene = bpy.context.scene
    scene.render.engine, cycles = "CYCLES", scene.cycles
    cycles.device, cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = "CPU", SAMPLES, False, True
    cycles.max_bounces = cycles.diffuse_bounces = bounces
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    scene.render.resolution_x = scene.render.resolution_y = SIDE
    scene.render.resolution_percentage, scene.render.image_settings.file_format = 100, "OPEN_EXR"
    scene.render.filepath = str(folder / f"{name}.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.empty(SIDE * SIDE * 4, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(SIDE, SIDE, 4)[::-1, :, :3]


def srgb(linear):
    x = np.clip(linear, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def look_at_the_box():
    """A camera in front of the box, where the scene has none."""
    if bpy.context.scene.camera is None:
        camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        camera.location, camera.rotation_euler, camera.data.lens = (2.78, -8.0, 2.73), (np.pi / 2, 0, 0), 50
        bpy.context.scene.collection.objects.link(camera)
        bpy.context.scene.camera = camera


def main():
    options = scene_options(__doc__).parse_args()
    bpy.ops.wm.open_mainfile(filepath=str(options.scenes / "cornell/cornell.blend"))
    look_at_the_box()
    names = [obj.name for obj in bpy.context.view_layer.objects if obj.type == "MESH" and obj.name != "Probes"]
    with tempfile.TemporaryDirectory() as folder:
        wanted = LightmapRequest(LightmapSettings(density=24.0, atlas="shared"), Path(folder), "cornell")
        job = BakeJob.prepare(bpy.context, [wanted], Progress(), names)
        solved = job.solve(settings_for("medium"), Progress())
        job.write(solved, Progress())
        direct, full = (rendered(Path(folder), str(bounces), bounces) for bounces in (0, 32))
        use_baked_light(bpy.context.scene)
        ours = rendered(Path(folder), "lightmaps", 0)
    off = (ours - full).mean()
    print(f"mean {off / full.mean():+.2%}, of the bounced light {off / (full - direct).mean():+.2%}")
    gap = np.ones((SIDE, GAP, 3))
    white = np.percentile(full, 95)
    write_png(options.pictures / "lightmaps_cornell.png", np.hstack([srgb(full / white), gap, srgb(ours / white)]))
    write_png(options.pictures / "lightmaps_atlas.png", contact_sheet(solved.outputs[0].images) / 255)


if __name__ == "__main__":
    main()
