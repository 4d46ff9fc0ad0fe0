"""A scene with its lightmaps shown under direct light alone, against Cycles' full render."""

import bpy
import numpy as np
from mathutils import Vector
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.settings.lightmap import LightmapSettings
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.lightmap import LightmapRequest

from .scenes import add_cube, add_lamp, add_material, add_plane

SIDE = 48


def add_corner():
    """A corner of two coloured walls and a floor, with a box and a lamp, seen by a camera."""

    def paint(name, colour, node="ShaderNodeBsdfDiffuse"):
        material, shader = add_material(name, node)
        shader.inputs[0].default_value = (*colour, 1)
        return material

    add_plane("Floor", size=4.0, material=paint("White", (0.8, 0.8, 0.8)))
    wall = add_plane("Wall", size=4.0, material=paint("Red", (0.8, 0.1, 0.1)))
    wall.location, wall.rotation_euler = (-2, 0, 2), (0, np.pi / 2, 0)
    back = add_plane("Back", size=4.0, material=paint("Green", (0.1, 0.7, 0.2)))
    back.location, back.rotation_euler = (0, 2, 2), (np.pi / 2, 0, 0)
    add_plane("Ceiling", size=4.0, material=paint("Grey", (0.6, 0.6, 0.6))).location.z = 4
    box = add_cube("Box", material=paint("Blue", (0.3, 0.4, 0.8), "ShaderNodeBsdfPrincipled"))
    box.location, box.scale, box.rotation_euler.z = (0.3, 0.4, 0.61), (0.6, 0.6, 0.6), 0.4
    add_lamp("AREA", location=(0.5, -0.5, 3.6), energy=150, size=0.8)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (3.5, -4.5, 2.4)
    camera.rotation_euler = (Vector((0, 0.3, 1.3)) - camera.location).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera


def rendered(tmp_path, name, bounces):
    """Cycles' picture, (SIDE, SIDE, 3)."""
    scene = bpy.context.scene
    scene.render.engine, cycles = "CYCLES", scene.cycles
    cycles.device, cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = "CPU", 128, False, False
    cycles.max_bounces = cycles.diffuse_bounces = bounces
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    scene.render.resolution_x = scene.render.resolution_y = SIDE
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(tmp_path / f"{name}.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.empty(SIDE * SIDE * 4, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(SIDE, SIDE, 4)[..., :3]


def test_lightmaps_look_like_all_bounces(empty_scene, tmp_path):
    add_corner()
    wanted = LightmapRequest(LightmapSettings(density=12.0, atlas="shared"), tmp_path, "scene")
    job = BakeJob.prepare(bpy.context, [wanted], Progress())
    settings = settings_for("medium", n_photons=100_000, n_gather_rays=256, n_cache_elements=10_000)
    job.write(job.solve(settings, Progress()), Progress())
    full, direct = rendered(tmp_path, "full", 32), rendered(tmp_path, "direct", 0)
    bpy.ops.photon_bake.use_baked_light()
    ours = rendered(tmp_path, "lightmaps", 0)
    indirect = (full - direct).mean()
    assert indirect > 0.15 * full.mean()
    blocks = (
        (ours - full).reshape(SIDE // 4, 4, SIDE // 4, 4, 3).mean(axis=(1, 3))
    )  # Cycles' own noise is in each pixel
    assert abs((ours - full).mean()) < 0.03 * indirect
    assert np.sqrt(np.mean(blocks**2)) < 0.06 * indirect
