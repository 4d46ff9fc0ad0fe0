"""Directional lightmaps: their files, and the light that they give to turned normals."""

import json

import bpy
import numpy as np
import pytest
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.output.lightmap import KINDS, decode_directional, directional_light, light_for_normals
from photon_bake.addon.settings.bake import settings_for
from photon_bake.operators.command_line.command import run

from .lightmap_scenes import QUICK, add_room, bake, pixels_of, prepare
from .scenes import add_cube, add_lamp, add_material, add_plane, cycles_bake

ALL_KINDS = ("indirect", *KINDS)


def files_of(folder, name, suffix=".exr"):
    """The images of a lightmap's files as Blender reads them, (h, w, 3) by kind."""
    images = {kind: bpy.data.images.load(str(folder / f"scene_{name}_{kind}{suffix}")) for kind in ALL_KINDS}
    for image in images.values():
        image.colorspace_settings.name = "Non-Color"
    return {kind: pixels_of(image)[..., :3] for kind, image in images.items()}


@pytest.mark.parametrize("file_format", ["exr_half", "exr_float", "hdr", "rgbm", "rgbd"])
def test_each_lightmap_has_four_more_files(empty_scene, tmp_path, file_format):
    add_room()
    _, solved = bake(tmp_path, ["Floor"], directional=True, file_format=file_format)
    suffix = {"hdr": ".hdr", "rgbm": ".png", "rgbd": ".png"}.get(file_format, ".exr")
    names = [f"scene_Floor_{kind}{suffix}" for kind in ALL_KINDS]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names)
    assert [path.name for path in solved.files] == names
    assert bpy.data.objects["Floor"]["lightmap_image"] == names[0]
    images = files_of(tmp_path, "Floor", suffix)
    shares = np.stack([images[kind] for kind in KINDS[1:]])
    assert shares.min() >= 0 and shares.max() <= 1.001
    if suffix != ".png":
        # The light of the floor's own normal is what the image without directions has
        up = np.broadcast_to(np.float32([0, 0, 1]), images["L0"].shape)
        flat = light_for_normals(*decode_directional(images), up)
        np.testing.assert_allclose(flat, images["indirect"], atol=0.02 * images["indirect"].max())


def test_the_plain_lightmap_is_that_of_a_bake_without_directions(empty_scene, tmp_path):
    """Within the noise that each of both has: their rays are not the same ones."""
    add_room()
    settings = settings_for("draft", n_photons=50_000, n_gather_rays=2048, n_cache_elements=5000, n_threads=1)
    images = []
    for directional in (False, True):
        job = prepare(tmp_path, ["Floor"], density=4.0, denoiser="none", directional=directional)
        solved = job.solve(settings, Progress())
        images.append(solved.outputs[0].images[0])
        noise = solved.irradiance.stderr / np.pi
    off = (images[1] - images[0]).mean(axis=2)
    assert np.sqrt(np.mean(off**2)) < 2.5 * np.sqrt(np.mean(noise**2))
    assert abs(off.mean()) < 0.02 * images[0].mean()


def add_turned_probe(tilt):
    """A small square over the floor that only cameras see, whose material turns its normal to `tilt`."""
    material, surface = add_material("Turned", "ShaderNodeBsdfDiffuse")
    turned = material.node_tree.nodes.new("ShaderNodeCombineXYZ")
    for socket, value in zip(turned.inputs, tilt, strict=True):
        socket.default_value = value
    material.node_tree.links.new(turned.outputs[0], surface.inputs["Normal"])
    material.cycles.use_bump_map_correction = False  # which darkens what comes in low
    probe = add_plane("Probe", size=0.1, material=material)
    probe.location = (0, 0, 0.01)
    probe.visible_diffuse = probe.visible_glossy = probe.visible_shadow = probe.visible_transmission = False
    return probe, turned


def add_hall():
    """A dark floor between a red wall and a white one, with a box, under a lamp and a ceiling."""

    def paint(name, colour):
        material, shader = add_material(name, "ShaderNodeBsdfDiffuse")
        shader.inputs["Color"].default_value = (*colour, 1)
        return material

    white = paint("White", (0.8, 0.8, 0.8))
    add_plane("Floor", size=4.0, material=paint("Dark", (0.1, 0.1, 0.1)))
    for name, x, material in (("Left", -1.6, paint("Red", (0.8, 0.1, 0.1))), ("Right", 1.6, white)):
        wall = add_plane(name, size=4.0, material=material)
        wall.location, wall.rotation_euler = (x, 0, 2), (0, np.pi / 2, 0)
    add_plane("Ceiling", size=4.0, material=white).location.z = 3
    box = add_cube("Box", material=paint("Blue", (0.2, 0.2, 0.8)))
    box.location, box.scale = (0.8, 1.2, 0.6), (0.4, 0.4, 0.6)
    add_lamp("AREA", location=(0.3, -0.5, 2.5), energy=100, size=0.5)


def test_turned_normals_get_the_light_that_cycles_gives_them(empty_scene, tmp_path):
    add_hall()
    probe, turned = add_turned_probe((0, 0, 1))
    settings = settings_for("medium", n_photons=200_000, n_gather_rays=4096, n_threads=1)
    job = prepare(tmp_path, ["Probe"], density=40.0, denoiser="none", directional=True)
    (image,) = job.solve(settings, Progress()).outputs[0].finished
    ours = [channels.mean(axis=(0, 1)) for channels in directional_light(image.light, image.slope, image.normal)]
    scene = bpy.context.scene
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = 32
    got, wanted = [], []
    for degrees, around in ((0, 0), (30, 0), (30, 180), (45, 90), (45, 270), (60, 45), (60, 225)):
        theta, phi = np.radians((degrees, around))
        normal = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
        for socket, value in zip(turned.inputs, normal, strict=True):
            socket.default_value = value
        wanted.append(cycles_bake(probe, "INDIRECT", samples=4096).mean(axis=0))
        probe.data.color_attributes.remove(probe.data.color_attributes["Cycles"])
        got.append(light_for_normals(*ours, normal))
    off, unturned = (np.sqrt(np.mean((value - np.array(wanted)) ** 2)) for value in (got, got[:1]))
    np.testing.assert_allclose(got[0], wanted[0], rtol=0.025)
    assert off < 0.09 * np.mean(wanted) and off < unturned / 4, "what no linear function of the normal tells is left"


def test_the_command_bakes_directional_lightmaps(empty_scene, tmp_path, capfd):
    add_room()
    command = ["--quality", "draft", "--photons", "5000"]
    maps, report = tmp_path / "maps", tmp_path / "r.json"
    options = ["--target", "lightmap", "--directional", "--output", str(maps), "--report", str(report)]
    assert run([*command, *options, "--objects", "Floor"]) == 0
    read = json.loads(report.read_text())
    assert len(read["files"]) == 5 and read["lightmap_settings"]["directional"] and read["counts"]["lightmaps"] == 1
    capfd.readouterr()
    assert run([*command, "--directional"]) == 2
    assert "--directional is for lightmaps" in capfd.readouterr().err
    assert run([*command, *options, "--gather", "light_volume"]) == 1
    assert "choose another Gather" in capfd.readouterr().err


def test_a_full_disk_leaves_all_images(empty_scene, tmp_path, monkeypatch):
    add_room()
    bake(tmp_path, ["Floor"], directional=True)
    old = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    job = prepare(tmp_path, ["Floor"], directional=True, density=8.0)
    solved, written = job.solve(QUICK, Progress()), []

    def write(path, *rest, **options):
        written.append(path)
        if len(written) > 3:
            raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr("photon_bake.addon.output.lightmap.image_files.write_exr", write)
    with pytest.raises(BakeError, match="No space left"):
        job.write(solved, Progress())
    assert len(written) == 4 and {path.name: path.read_bytes() for path in tmp_path.iterdir()} == old
