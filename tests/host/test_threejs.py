"""What Export glTF writes, drawn by three.js in a headless Chromium, against Cycles' picture of the same view."""

import json

import bpy
import numpy as np
import pytest
from mathutils import Vector
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.settings.lightmap import LightmapSettings
from photon_bake.operators.command_line.command import run
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.lightmap import LightmapRequest
from photon_bake.operators.targets.vertices import VertexRequest
from photon_bake.tests.host.camera_scenes import build_room
from photon_bake.tests.host.scenes import add_lamp, add_material
from photon_bake.tests.web.browser import lacking, posted

pytestmark = pytest.mark.skipif(bool(lacking()), reason=lacking() or "all is there")

WIDTH, HEIGHT, BLOCK = 96, 72, 6
FINE = 4
"""Pixels that three.js draws along a side of each of the picture's."""


def paint(name, colour, specular=0.0):
    material, shader = add_material(name)
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Specular IOR Level"].default_value, shader.inputs["Roughness"].default_value = specular, 1.0
    return material


def add_grid(name, location, rotation, material, size=4.0, n=64):
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=n, y_subdivisions=n, size=size, location=location, rotation=rotation)
    grid = bpy.context.object
    grid.name = name
    grid.data.materials.append(material)


def add_terrace(specular=0.0):
    """A corner of two coloured walls and a floor with a block, in the sun, seen by a camera."""
    add_grid("Floor", (0, 0, 0), (0, 0, 0), paint("White", (0.8, 0.8, 0.8), specular))
    add_grid("Wall", (-2, 0, 2), (0, np.pi / 2, 0), paint("Red", (0.8, 0.15, 0.1), specular))
    add_grid("Back", (0, 2, 2), (np.pi / 2, 0, 0), paint("Green", (0.2, 0.7, 0.2), specular))
    bpy.ops.mesh.primitive_cube_add(size=1.2, location=(0.2, 0.3, 0.65), rotation=(0, 0, 0.4))
    block = bpy.context.object
    block.name = "Block"
    block.data.materials.append(paint("Blue", (0.4, 0.5, 0.8), specular))
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.subdivide(number_cuts=20)
    bpy.ops.object.mode_set(mode="OBJECT")
    sun = add_lamp("SUN", energy=3.0, angle=0.0)
    sun.rotation_euler = Vector((-0.9, 0.35, -0.8)).to_track_quat("-Z", "Y").to_euler()
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (4.2, -5.4, 3.2)
    camera.rotation_euler = (Vector((-0.3, 0.3, 1.2)) - camera.location).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(camera)
    scene = bpy.context.scene
    scene.camera, scene.render.resolution_x, scene.render.resolution_y = camera, WIDTH, HEIGHT


def bake(folder):
    wanted = [LightmapRequest(LightmapSettings(density=16.0), folder, "scene"), VertexRequest()]
    job = BakeJob.prepare(bpy.context, wanted, Progress())
    settings = settings_for("medium", n_photons=300_000, n_gather_rays=256, n_cache_elements=20_000)
    job.write(job.solve(settings, Progress()), Progress())


def cycles(tmp_path, bounces, samples):
    """Cycles' picture, (HEIGHT, WIDTH, 3), row 0 at the bottom."""
    scene = bpy.context.scene
    scene.render.engine, cycles = "CYCLES", scene.cycles
    cycles.device, cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = "CPU", samples, False, False
    cycles.max_bounces = cycles.diffuse_bounces = bounces
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.pixel_filter_type = "BOX"
    scene.render.threads_mode, scene.render.threads = "FIXED", 2
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(tmp_path / f"{bounces}.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.empty(WIDTH * HEIGHT * 4, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(HEIGHT, WIDTH, 4)[..., :3]


def drawn(tmp_path, query):
    """three.js' picture, (HEIGHT, WIDTH, 3), row 0 at the bottom."""
    fine = f"page.html?width={FINE * WIDTH}&height={FINE * HEIGHT}&{query}"
    pixels = np.frombuffer(posted(tmp_path, fine), np.float32).reshape(HEIGHT, FINE, WIDTH, FINE, 4)
    return pixels.mean(axis=(1, 3))[..., :3]


def differences(ours, truth):
    """Of the mean, and the root mean square over blocks of pixels, both over the mean."""
    blocks = (ours - truth).reshape(HEIGHT // BLOCK, BLOCK, WIDTH // BLOCK, BLOCK, 3).mean(axis=(1, 3))
    return (ours - truth).mean() / truth.mean(), np.sqrt(np.mean(blocks**2)) / truth.mean()


@pytest.mark.long
def test_page_looks_as_cycles(empty_scene, tmp_path):
    """Baked light alone against Cycles' indirect light, and with the sun against the whole picture."""
    add_terrace()
    bake(tmp_path)
    assert bpy.ops.photon_bake.export_gltf(filepath=str(tmp_path / "scene.glb"), cameras=True) == {"FINISHED"}
    full, direct = cycles(tmp_path, 32, 256), cycles(tmp_path, 0, 64)
    truths, found = {"": full - direct, "&lights": full}, {}
    for source in ("lightmap", "vertex"):
        for lights, truth in truths.items():
            found[source + lights] = differences(drawn(tmp_path, f"baked={source}{lights}"), truth)
    assert (full - direct).mean() > 0.1 * full.mean()
    for picture, (mean, blocks) in found.items():
        assert abs(mean) < 0.01
        assert blocks < (0.015 if "lights" in picture else 0.03)  # half of which is Cycles' noise in bounced light


def test_probes_light_a_ball(empty_scene, tmp_path):
    """A white ball between eight probes shows E/π of its normals, by the harmonics of the JSON file."""
    build_room(empty_scene, (8, 8))
    data = bpy.data.lightprobes.new("Volume", "VOLUME")
    data.resolution_x, data.resolution_y, data.resolution_z = 3, 2, 2
    volume = bpy.data.objects.new("Volume", data)
    volume.scale, volume.location = (0.9, 0.7, 0.5), (0, 0, 0.2)
    empty_scene.collection.objects.link(volume)
    quick = ["--quality", "draft", "--photons", "20000", "--axes", "gltf"]
    assert run(["--target", "probes", "--output", str(tmp_path), *quick]) == 0
    (grid,) = json.loads((tmp_path / "Scene_probes.json").read_text())["grids"]
    i, size = 7, 64
    at, sh = grid["position"][i], np.array(grid["radiance"][i])
    page = f"probes.html?size={size}&radius=0.001&at={','.join(map(str, at))}"
    pixels = np.frombuffer(posted(tmp_path, page), np.float32).reshape(size, size, 4)[..., :3]
    x, y = np.meshgrid(*2 * [(np.arange(size) + 0.5) / size * 2 - 1])
    inside = x**2 + y**2 < 0.9
    n = np.stack([x, y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], axis=-1)[inside]
    y = np.concatenate([np.full((len(n), 1), 0.282095), 0.488603 * 2 / 3 * n], axis=1)
    np.testing.assert_allclose(pixels[inside], np.maximum(y @ sh, 0), rtol=0.02, atol=0.02 * pixels.mean())
    assert np.ptp(pixels[inside][:, 0]) > 0.1 * pixels.mean()
