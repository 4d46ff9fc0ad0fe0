"""Lightmaps from the scene to files and Blender's data, and what may go wrong on the way."""

import json
import os
import re
import shutil
import subprocess
import sys
from contextlib import suppress
from dataclasses import replace

import bpy
import numpy as np
import pytest
from photon_bake.addon.camera_settings import CameraSettings
from photon_bake.addon.errors import BakeError, Cancelled
from photon_bake.addon.gather import Irradiance
from photon_bake.addon.lightmap_settings import LightmapSettings
from photon_bake.addon.output.lightmap import FileFormat
from photon_bake.addon.parallel import Workers
from photon_bake.addon.progress import Progress
from photon_bake.addon.tracers.embree import EmbreeTracer
from photon_bake.addon.ui.state import CAMERA_SHARES, LIGHTMAP_SHARES, STAGE_SHARES, bake_state, share_done
from photon_bake.operators.bake_job import BakeJob
from photon_bake.operators.camera_target import WantedCamera
from photon_bake.operators.command_line import run
from photon_bake.operators.lightmap_target import WantedLightmaps
from photon_bake.operators.vertex_target import WantedVertices

from .camera_scenes import add_camera
from .lightmap_scenes import QUICK, add_room, bake, pixels_of, prepare, uv_of
from .scenes import add_cube, add_plane

COMMAND = ["--quality", "draft", "--photons", "5000", "--target", "lightmap", "--density", "4"]


@pytest.fixture(autouse=True)
def room(empty_scene):
    add_room()


def state():
    """What a bake of lightmaps may change."""
    meshes = {mesh.name: [layer.name for layer in mesh.uv_layers] for mesh in bpy.data.meshes}
    objects = {obj.name: sorted(obj.keys()) for obj in bpy.data.objects}
    return meshes, objects, [image.name for image in bpy.data.images], [scene.name for scene in bpy.data.scenes]


def test_light_reaches_files_images_and_objects(tmp_path):
    _, solved = bake(tmp_path / "maps")
    assert sorted(path.name for path in (tmp_path / "maps").iterdir()) == [
        "scene_Box_indirect.exr",
        "scene_Floor_indirect.exr",
    ]
    floor, image = bpy.data.objects["Floor"], bpy.data.images["Photon Bake Floor"]
    assert floor["lightmap_image"] == "scene_Floor_indirect.exr" and floor["lightmap_uv_map"] == "Photon Bake"
    assert tuple(floor["lightmap_scale_offset"]) == (1, 1, 0, 0)
    assert image.is_float and image.colorspace_settings.name == "Linear Rec.709" and image.use_fake_user
    (lightmaps,) = solved.products
    wanted = lightmaps.images[lightmaps.target.layout.names.index("Floor")]
    np.testing.assert_allclose(pixels_of(image)[..., :3], wanted, rtol=2e-3, atol=1e-4)
    assert wanted.max() > 0
    assert solved.counts["lightmaps"] == 2 and solved.counts["covered_texels"] <= solved.counts["lightmap_texels"]


def test_the_other_uv_maps_stay_and_stay_active(tmp_path):
    floor = bpy.data.objects["Floor"]
    floor.data.uv_layers.new(name="Second")
    before = uv_of(floor, "UVMap").copy()
    bake(tmp_path)
    layers = floor.data.uv_layers
    assert [layer.name for layer in layers] == ["UVMap", "Second", "Photon Bake"]
    assert layers.active.name == "UVMap" and [layer.name for layer in layers if layer.active_render] == ["UVMap"]
    assert np.array_equal(uv_of(floor, "UVMap"), before) and uv_of(floor).min() >= 0 and uv_of(floor).max() <= 1


def test_light_of_texels_is_that_of_vertices(tmp_path):
    """Both in one job share photons and cache, and give the same light in the same places."""
    add_plane("Wall", size=6.0).rotation_euler = (0, 1.2, 0)
    settings = LightmapSettings(density=2.0, denoiser="none", uv_map="")
    wanted = [WantedLightmaps(settings, tmp_path, "scene"), WantedVertices(fit=False)]
    job = BakeJob.prepare(bpy.context, wanted, Progress(), ["Floor"])
    assert job.object_names == ["Floor"]
    solved = job.solve(QUICK.__class__(**{**QUICK.__dict__, "n_gather_rays": 1024}), Progress())
    job.write(solved, Progress())
    floor = bpy.data.objects["Floor"]
    colors = np.empty((len(floor.data.loops), 4), np.float32)
    floor.data.attributes["Indirect"].data.foreach_get("color", colors.ravel())
    image = pixels_of(bpy.data.images["Photon Bake Floor"])
    height, width = image.shape[:2]
    at = np.clip((uv_of(floor) * (width, height)).astype(int), 0, (width - 1, height - 1))
    np.testing.assert_allclose(image[at[:, 1], at[:, 0], :3].mean(), colors[:, :3].mean(), rtol=0.3)


def test_interpolated_light_is_not_filtered_by_itself(tmp_path):
    """Its noise is no finer than what it shows; where every texel has gathered, a filter helps."""
    job = prepare(tmp_path, ["Floor"], density=4.0)
    points = job.targets[0].points(job.scene, EmbreeTracer(job.scene), Workers(), [])
    n = len(points.receivers)
    noisy = np.random.default_rng(0).uniform(1, 2, (n, 3)).astype(np.float32)

    def finished(denoiser, n_records):
        passes, gathered = {"indirect": noisy}, np.arange(n) < n_records
        light = Irradiance(noisy, np.full(n, 0.3, np.float32), passes, {}, gathered=gathered)
        of = replace(points.target, settings=replace(points.target.settings, denoiser=denoiser))
        return replace(points, target=of).finish(light, Workers()).images[0]

    assert np.array_equal(finished("auto", n // 4), finished("none", n // 4))
    assert finished("auto", n).std() < 0.9 * finished("none", n).std()


def test_a_bake_again_uses_images_and_uv_maps_again(tmp_path):
    bake(tmp_path)
    before, image = state(), bpy.data.images["Photon Bake Floor"]
    bake(tmp_path, density=8.0)
    assert state() == before and bpy.data.images["Photon Bake Floor"] == image
    assert image.size[0] >= 48 and np.isfinite(pixels_of(image)).all()


@pytest.mark.parametrize("file_format", FileFormat.__args__)
def test_all_formats_have_their_colour_space(tmp_path, file_format):
    assert file_format in LightmapSettings.__annotations__["file_format"].__args__
    bake(tmp_path, ["Box"], file_format=file_format)
    image = bpy.data.images["Photon Bake Box"]
    encoded = file_format.startswith("rgb")
    assert image.colorspace_settings.name == ("Non-Color" if encoded else "Linear Rec.709")
    assert image.is_float != encoded and image.size[0] > 0


def test_objects_that_share_a_mesh_share_an_atlas(tmp_path):
    twin = bpy.data.objects.new("Twin", bpy.data.objects["Box"].data)
    bpy.context.scene.collection.objects.link(twin)
    twin.location = (-2.5, -2, 1)
    bake(tmp_path, atlas="shared")
    box = bpy.data.objects["Box"]
    assert [path.name for path in tmp_path.iterdir()] == ["scene_Atlas_indirect.exr"]
    assert tuple(box["lightmap_scale_offset"]) != tuple(twin["lightmap_scale_offset"])
    assert box["lightmap_image"] == twin["lightmap_image"]


@pytest.mark.parametrize("seed_threads", [1, 2])
def test_the_same_seed_gives_the_same_maps(tmp_path, seed_threads):
    _, one = bake(tmp_path)
    _, other = bake(tmp_path)
    for a, b in zip(one.products[0].images, other.products[0].images, strict=True):
        assert np.array_equal(a, b)


def test_nothing_changes_before_the_light_is_written(tmp_path):
    before = state()
    job = prepare(tmp_path / "maps")
    assert state() == before
    job.solve(QUICK, Progress())
    assert state() == before and not (tmp_path / "maps").exists()


def test_a_cancelled_bake_changes_nothing(tmp_path):
    before, job, progress = state(), prepare(tmp_path / "maps"), Progress()
    progress.cancel()
    with pytest.raises(Cancelled):
        job.solve(QUICK, progress)
    assert state() == before and not (tmp_path / "maps").exists()


def test_a_mesh_edited_meanwhile_is_left_out_alone(tmp_path):
    bake(tmp_path)
    old = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    job = prepare(tmp_path, density=8.0)
    solved = job.solve(QUICK, Progress())
    bpy.data.objects["Floor"].data.loops.add(3)
    written = job.write(solved, Progress())
    assert [path.name for path in written.files] == ["scene_Box_indirect.exr"]
    (warning,) = job.warnings
    assert "'Floor' got no light, since its mesh was changed" in warning
    assert (tmp_path / "scene_Floor_indirect.exr").read_bytes() == old["scene_Floor_indirect.exr"]
    assert (tmp_path / "scene_Box_indirect.exr").read_bytes() != old["scene_Box_indirect.exr"]


def test_renamed_objects_and_meshes_get_their_lightmaps(tmp_path):
    job = prepare(tmp_path, density=4.0)
    solved = job.solve(QUICK, Progress())
    floor = bpy.data.objects["Floor"]
    floor.name, floor.data.name = "Ground", "Ground"
    job.write(solved, Progress())
    assert job.warnings == [] and "Photon Bake" in floor.data.uv_layers and "lightmap_image" in floor


def test_edit_mode_entered_meanwhile_is_come_back_to(tmp_path):
    job = prepare(tmp_path, density=4.0)
    solved = job.solve(QUICK, Progress())
    floor = bpy.data.objects["Floor"]
    bpy.context.view_layer.objects.active = floor
    bpy.ops.object.mode_set(mode="EDIT")
    job.write(solved, Progress())
    assert floor.mode == "EDIT" and job.warnings == []
    bpy.ops.object.mode_set(mode="OBJECT")
    assert "Photon Bake" in floor.data.uv_layers and "lightmap_image" in floor


def full_disk(monkeypatch, of):
    """A disk that has no room for files whose name has some word in it."""

    def replace(source, target, real=os.replace):
        if of in str(target):
            raise OSError(28, "No space left on device")
        real(source, target)

    monkeypatch.setattr("photon_bake.addon.output.files.os.replace", replace)


def test_a_full_disk_leaves_the_old_images(tmp_path, monkeypatch):
    bake(tmp_path)
    old = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    job = prepare(tmp_path, density=8.0)
    solved, before = job.solve(QUICK, Progress()), state()
    full_disk(monkeypatch, "indirect")
    with pytest.raises(BakeError, match="No space left") as error:
        job.write(solved, Progress())
    assert "\n" not in str(error.value) and state() == before
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == old


@pytest.fixture
def small_disk(tmp_path):
    """A disk of 1 MB, where the system lets us make one."""
    if sys.platform != "linux" or os.geteuid() != 0:
        pytest.skip("mounting is root's")
    disk = tmp_path / "disk"
    disk.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", disk], capture_output=True).returncode:
        pytest.skip("this system mounts nothing")
    yield disk
    subprocess.run(["umount", disk], check=True)


def fill(disk):
    """Leave no room."""
    with suppress(OSError), (disk / "rest").open("wb", buffering=0) as file:
        while True:
            file.write(bytes(4096))


def test_a_disk_that_fills_up_during_the_bake_loses_no_more_than_it_must(small_disk):
    bake(small_disk)
    old = (small_disk / "scene_Floor_indirect.exr").read_bytes()
    wanted = [WantedLightmaps(LightmapSettings(density=8.0), small_disk, "scene"), WantedVertices()]
    job = BakeJob.prepare(bpy.context, wanted, Progress())
    job.check_space()
    solved = job.solve(QUICK, Progress())
    fill(small_disk)
    (failure,) = job.write(solved, Progress()).failures
    assert "cannot be written (No space left on device)" in failure
    assert "Indirect" in bpy.data.objects["Floor"].data.attributes
    assert (small_disk / "scene_Floor_indirect.exr").read_bytes() == old
    assert sorted(path.name for path in small_disk.iterdir()) == [
        "rest",
        "scene_Box_indirect.exr",
        "scene_Floor_indirect.exr",
    ]
    with pytest.raises(BakeError, match="make room"):
        job.check_space()


def test_a_file_is_saved_elsewhere_where_its_disk_is_full(small_disk, capfd):
    fill(small_disk)
    (small_disk / "rest").rename(small_disk / "x.blend")  # there is room for a name
    assert run(["--quality", "draft", "--photons", "5000", "--save", str(small_disk / "x.blend")]) == 1
    said = capfd.readouterr().err
    (kept,) = re.findall(r"could not be saved .*; the baked file is (.*): move it\.", said)
    bpy.ops.wm.open_mainfile(filepath=kept)
    assert "Indirect" in bpy.data.objects["Floor"].data.attributes
    shutil.rmtree(os.path.dirname(kept))


def test_what_a_full_disk_has_room_for_is_written(tmp_path, monkeypatch):
    job = prepare(tmp_path, density=4.0)
    solved = job.solve(QUICK, Progress())
    full_disk(monkeypatch, "Floor")
    written = job.write(solved, Progress())
    assert [path.name for path in written.files] == ["scene_Box_indirect.exr"]
    (failure,) = written.failures
    assert f"{tmp_path / 'scene_Floor_indirect.exr'} cannot be written (No space left on device)" in failure
    assert "lightmap_image" in bpy.data.objects["Box"] and "lightmap_image" not in bpy.data.objects["Floor"]
    assert [path.name for path in tmp_path.iterdir()] == ["scene_Box_indirect.exr"]


def test_an_image_open_elsewhere_stays_as_it_was(tmp_path, monkeypatch):
    """Windows refuses to open such a file for writing."""
    bake(tmp_path)
    old = (tmp_path / "scene_Floor_indirect.exr").read_bytes()
    job = prepare(tmp_path, density=8.0)
    solved = job.solve(QUICK, Progress())

    real = type(tmp_path).open

    def in_use(path, mode="r", *rest):
        if mode == "r+b" and "Floor" in path.name:
            raise PermissionError(13, "The file is being used by another process")
        return real(path, mode, *rest)

    monkeypatch.setattr(type(tmp_path), "open", in_use)
    (failure,) = job.write(solved, Progress()).failures
    monkeypatch.undo()
    assert "scene_Floor_indirect.exr cannot be written (The file is being used" in failure
    assert (tmp_path / "scene_Floor_indirect.exr").read_bytes() == old


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may write anywhere")
def test_a_read_only_folder_is_found_before_the_bake(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(BakeError, match="cannot be written"):
        prepare(tmp_path)


def test_a_read_only_disk_leaves_the_old_images(tmp_path, monkeypatch):
    """Whether it is so before the bake or becomes so while it runs, as a server's folder may; root meets it too."""

    def read_only(**_):
        raise OSError(30, "Read-only file system")

    bake(tmp_path)
    old = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    job = prepare(tmp_path, density=8.0)
    solved, before = job.solve(QUICK, Progress()), state()
    monkeypatch.setattr("photon_bake.addon.output.files.TemporaryFile", read_only)
    for attempt in (lambda: prepare(tmp_path), lambda: job.write(solved, Progress())):
        with pytest.raises(BakeError, match=r"scene_\w+_indirect.exr cannot be written \(Read-only file system\)"):
            attempt()
    assert state() == before and {path.name: path.read_bytes() for path in tmp_path.iterdir()} == old


def test_places_that_take_no_files_are_found_before_the_bake(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BakeError, match="is a file; give a folder"):
        prepare(tmp_path / "file")
    with pytest.raises(BakeError, match="cannot be written"):
        prepare(tmp_path / "file" / "below")
    (tmp_path / "scene_Box_indirect.exr").mkdir()
    with pytest.raises(BakeError, match="is a folder"):
        prepare(tmp_path)


def test_names_that_would_be_one_file_are_found(tmp_path):
    add_cube("A/B").location.x = 5
    add_cube("A:B").location.x = -5
    with pytest.raises(BakeError, match="rename one"):
        prepare(tmp_path)


def test_the_button_bakes_what_the_panel_says(tmp_path):
    properties = bpy.context.scene.photon_bake
    for name in ("n_photons", "n_gather_rays", "n_cache_elements", "n_cache_rays"):
        setattr(properties, name, getattr(QUICK, name))
    properties.targets, properties.lightmap.density = {"lightmap"}, 4.0
    with pytest.raises(RuntimeError, match="never saved"):
        bpy.ops.photon_bake.bake_indirect()
    properties.lightmap.folder = str(tmp_path)
    assert bpy.ops.photon_bake.bake_indirect() == {"FINISHED"}
    assert bpy.data.images["Photon Bake Floor"].size[0] > 0 and "points in" in bake_state.result
    assert "Indirect" not in bpy.data.objects["Floor"].data.attributes
    properties.targets = set()
    with pytest.raises(RuntimeError, match="choose Vertices, Lightmaps, Camera or Probes"):
        bpy.ops.photon_bake.bake_indirect()


def test_properties_are_the_lightmaps_knobs():
    assert bpy.context.scene.photon_bake.lightmap.settings() == LightmapSettings()


def test_the_progress_bar_knows_the_stages_of_lightmaps(tmp_path):
    shown, done, shares = {}, [], STAGE_SHARES["final"] | LIGHTMAP_SHARES

    def listen(stage, fraction):
        shown[stage] = fraction
        done.append(share_done(shares, shown))

    progress = Progress(listen)
    wanted = WantedLightmaps(LightmapSettings(density=4.0), tmp_path, "scene")
    BakeJob.prepare(bpy.context, [wanted], progress).solve(QUICK, progress)
    assert set(LIGHTMAP_SHARES) <= set(shown) and done == sorted(done)


def test_the_progress_of_several_targets_never_falls(tmp_path):
    """Of targets that both are denoised, and lightmaps that are looked around more than once."""
    bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = 24, 16
    add_camera(bpy.context.scene, (0, -8, 2))
    shown, done, shares = {}, [], STAGE_SHARES["final"] | LIGHTMAP_SHARES | CAMERA_SHARES
    assert len(shares) == len(STAGE_SHARES["final"]) + len(LIGHTMAP_SHARES) + len(CAMERA_SHARES)

    def listen(stage, fraction):
        assert fraction >= shown.get(stage, 0) or stage not in shares, stage
        shown[stage] = fraction
        done.append(share_done(shares, shown))

    progress = Progress(listen)
    settings = LightmapSettings(density=4.0, denoiser="own")
    wanted = WantedLightmaps(settings, tmp_path, "scene"), WantedCamera(CameraSettings(), tmp_path), WantedVertices()
    BakeJob.prepare(bpy.context, wanted, progress).solve(QUICK, progress)
    assert {"Denoising", "Denoising the pass"} <= set(shown) and done == sorted(done)


def test_the_command_bakes_both_targets(tmp_path, capfd):
    maps, report, sheet = tmp_path / "maps", tmp_path / "r.json", tmp_path / "sheet.png"
    options = ["--target", "vertex", "--output", str(maps), "--preview", str(sheet), "--report", str(report)]
    assert run([*COMMAND, *options, "--atlas", "shared", "--format", "exr_float", "--denoise", "none"]) == 0
    read = json.loads(report.read_text())
    stem = bpy.context.scene.name
    assert read["files"] == [str(maps / f"{stem}_Atlas_indirect.exr"), str(sheet)]
    assert read["lightmap_settings"]["atlas"] == "shared" and read["lightmap_settings"]["density"] == 4
    assert read["counts"]["lightmaps"] == 1 and set(read["objects"]) == {"Floor", "Box"}
    assert "Indirect" in bpy.data.objects["Floor"].data.attributes
    assert "2 objects and 1 lightmap in" in capfd.readouterr().err
    assert max(bpy.data.images.load(str(sheet)).size) > 100


def test_the_command_names_the_object_that_cannot_have_a_lightmap(tmp_path, capfd):
    assert run([*COMMAND, "--output", str(tmp_path), "--uv", "UVMap"]) == 0
    assert "Left out: Object 'Box' has no UV map 'UVMap'" in capfd.readouterr().err
    bpy.data.objects.remove(bpy.data.objects["Floor"])
    assert run([*COMMAND, "--output", str(tmp_path / "none"), "--uv", "UVMap"]) == 1
    said = capfd.readouterr().err
    assert "'Box' has no UV map 'UVMap'" in said and "Traceback" not in said and not (tmp_path / "none").exists()


def test_a_name_that_is_too_long_is_found_before_the_bake(tmp_path):
    bpy.data.objects["Box"].name = "B" * 63
    job = prepare(tmp_path / ("d" * 200), density=4.0)
    job.write(job.solve(QUICK, Progress()), Progress())
    wanted = WantedLightmaps(LightmapSettings(density=4.0), tmp_path, "s" * 180)
    with pytest.raises(BakeError, match=r"too long for its folder, which takes 255 bytes: shorten it\."):
        BakeJob.prepare(bpy.context, [wanted], Progress())


def test_too_little_room_is_found_before_the_bake(tmp_path, monkeypatch):
    job = prepare(tmp_path, density=4.0)
    job.check_space()
    usage = shutil.disk_usage(tmp_path)._replace(free=1000)
    monkeypatch.setattr("photon_bake.addon.output.files.shutil.disk_usage", lambda _: usage)
    with pytest.raises(BakeError, match=r"has 0 MB free, and up to .* MB would be written: make room"):
        job.check_space()


def test_copies_get_lightmaps_and_keep_vertex_light(tmp_path):
    """An object whose modifiers copy faces has its lightmap on a copy, which takes its place in renders."""
    box = bpy.data.objects["Box"]
    box.modifiers.new("Array", "ARRAY")
    for _ in range(2):
        wanted = WantedLightmaps(LightmapSettings(density=4.0), tmp_path, "scene", copies=True)
        job = BakeJob.prepare(bpy.context, [wanted], Progress())
        job.write(job.solve(QUICK, Progress()), Progress())
        (copy,) = [obj for obj in bpy.data.objects if obj.get("photon_bake_original") == box]
        assert copy["lightmap_image"] == "scene_Box_indirect.exr" and copy["lightmap_uv_map"] == "Photon Bake"
        assert len(copy.data.uv_layers["Photon Bake"].uv) == 2 * len(box.data.loops) and np.ptp(uv_of(copy)) > 0.5
        assert box.hide_render and not copy.hide_render and "Photon Bake" not in box.data.uv_layers
        assert bpy.data.objects["Floor"]["lightmap_image"] and "lightmap_image" not in box
        copy.data.color_attributes.new("Indirect", "FLOAT_COLOR", "CORNER")
    job = BakeJob.prepare(
        bpy.context, [WantedLightmaps(LightmapSettings(), tmp_path, "scene", copies=True)], Progress()
    )
    solved = job.solve(QUICK, Progress())
    shutil.rmtree(tmp_path)
    tmp_path.write_text("no folder")
    with pytest.raises(BakeError):
        job.write(solved, Progress())
    assert copy.name in bpy.data.objects and len([mesh for mesh in bpy.data.meshes if "(Baked)" in mesh.name]) == 1


@pytest.mark.parametrize("maps_first", [True, False])
def test_copies_that_one_target_needs_have_the_light_of_both(tmp_path, maps_first):
    """Vertices need copies of meshes that objects share, lightmaps of those whose modifiers lose UV maps."""
    floor, box = bpy.data.objects["Floor"], bpy.data.objects["Box"]
    other = bpy.data.objects.new("Other", floor.data)
    bpy.context.scene.collection.objects.link(other)
    other.location.z = 5
    box.modifiers.new("Solidify", "SOLIDIFY").thickness = 0.2
    wanted = [WantedLightmaps(LightmapSettings(density=4.0), tmp_path, "scene", copies=True), WantedVertices("V", True)]
    job = BakeJob.prepare(bpy.context, wanted if maps_first else wanted[::-1], Progress())
    job.write(job.solve(QUICK, Progress()), Progress())
    copies = [obj for obj in bpy.data.objects if "photon_bake_original" in obj]
    assert sorted(copy["photon_bake_original"].name for copy in copies) == ["Box", "Floor", "Other"]
    for copy in copies:
        assert "V" in copy.data.color_attributes and copy["lightmap_image"] and np.ptp(uv_of(copy)) > 0.5
        assert "photon_bake_hide_render" not in copy


def test_names_that_collide_are_both_named(tmp_path):
    add_plane("A/b")
    add_plane("A:b")
    with pytest.raises(BakeError, match=r"objects 'A.b' and 'A.b' differ only in signs"):
        prepare(tmp_path)
