"""Lightmaps from the scene to files and Blender's data, and what may go wrong on the way."""

import json
import shutil
from dataclasses import replace

import bpy
import numpy as np
import pytest
from photon_bake.addon.core.errors import BakeError, Cancelled
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.gather import Irradiance
from photon_bake.addon.output.lightmap import FileFormat
from photon_bake.addon.settings.camera import CameraSettings
from photon_bake.addon.settings.lightmap import LightmapSettings
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.addon.ui.state import CAMERA_SHARES, LIGHTMAP_SHARES, STAGE_SHARES, bake_state, share_done
from photon_bake.operators.command_line.command import run
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.camera import CameraRequest
from photon_bake.operators.targets.lightmap import LightmapRequest
from photon_bake.operators.targets.vertices import VertexRequest

from .camera_scenes import add_camera
from .lightmap_scenes import QUICK, add_room, bake, pixels_of, prepare, state, uv_of
from .scenes import add_plane

COMMAND = ["--quality", "draft", "--photons", "5000", "--target", "lightmap", "--density", "4"]


@pytest.fixture(autouse=True)
def room(empty_scene):
    add_room()


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
    (lightmaps,) = solved.outputs
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
    wanted = [LightmapRequest(settings, tmp_path, "scene"), VertexRequest(fit=False)]
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
    points = job.targets[0].samples(job.scene, EmbreeTracer(job.scene), Workers(), [])
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
    for a, b in zip(one.outputs[0].images, other.outputs[0].images, strict=True):
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
    wanted = LightmapRequest(LightmapSettings(density=4.0), tmp_path, "scene")
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
    wanted = LightmapRequest(settings, tmp_path, "scene"), CameraRequest(CameraSettings(), tmp_path), VertexRequest()
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


def test_copies_get_lightmaps_and_keep_vertex_light(tmp_path):
    """An object whose modifiers copy faces has its lightmap on a copy, which takes its place in renders."""
    box = bpy.data.objects["Box"]
    box.modifiers.new("Array", "ARRAY")
    for _ in range(2):
        wanted = LightmapRequest(LightmapSettings(density=4.0), tmp_path, "scene", copies=True)
        job = BakeJob.prepare(bpy.context, [wanted], Progress())
        job.write(job.solve(QUICK, Progress()), Progress())
        (copy,) = [obj for obj in bpy.data.objects if obj.get("photon_bake_original") == box]
        assert copy["lightmap_image"] == "scene_Box_indirect.exr" and copy["lightmap_uv_map"] == "Photon Bake"
        assert len(copy.data.uv_layers["Photon Bake"].uv) == 2 * len(box.data.loops) and np.ptp(uv_of(copy)) > 0.5
        assert box.hide_render and not copy.hide_render and "Photon Bake" not in box.data.uv_layers
        assert bpy.data.objects["Floor"]["lightmap_image"] and "lightmap_image" not in box
        copy.data.color_attributes.new("Indirect", "FLOAT_COLOR", "CORNER")
    job = BakeJob.prepare(
        bpy.context, [LightmapRequest(LightmapSettings(), tmp_path, "scene", copies=True)], Progress()
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
    wanted = [LightmapRequest(LightmapSettings(density=4.0), tmp_path, "scene", copies=True), VertexRequest("V", True)]
    job = BakeJob.prepare(bpy.context, wanted if maps_first else wanted[::-1], Progress())
    job.write(job.solve(QUICK, Progress()), Progress())
    copies = [obj for obj in bpy.data.objects if "photon_bake_original" in obj]
    assert sorted(copy["photon_bake_original"].name for copy in copies) == ["Box", "Floor", "Other"]
    for copy in copies:
        assert "V" in copy.data.color_attributes and copy["lightmap_image"] and np.ptp(uv_of(copy)) > 0.5
        assert "photon_bake_hide_render" not in copy
