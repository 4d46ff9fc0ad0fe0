"""The camera's pass by the command and the button: files, frames, bad input."""

import json

import bpy
import numpy as np
import OpenEXR
import pytest
from photon_bake.addon.core.errors import Cancelled
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.settings.camera import CameraSettings
from photon_bake.operators.command_line.command import run
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.camera import CameraRequest
from photon_bake.tests.host.camera_scenes import add_camera, build_room, coloured
from photon_bake.tests.host.scenes import add_cube, add_lamp

QUICK = [
    "--quality",
    "draft",
    "--photons",
    "10000",
    "--gather-rays",
    "16",
    "--pixel-samples",
    "1",
    "--file-name",
    "indirect_####",
    "--pass-denoise",
    "none",
]


class CancelsAt(Progress):
    """Is cancelled once a stage has begun."""

    def __init__(self, stage):
        super().__init__(lambda at, _: self.cancel() if at == stage else None)


def channels(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        found = {name.removeprefix("PhotonBake."): c.pixels for name, c in file.channels().items()}
        return {name: np.array(pixels, np.float32) for name, pixels in found.items()}


def bake(folder, *more):
    return run(["--target", "camera", "--output", str(folder), *QUICK, *more])


def test_command_writes_a_file_and_a_report(empty_scene, tmp_path):
    build_room(empty_scene, (24, 16))
    empty_scene.frame_set(7)
    assert bake(tmp_path / "passes", "--report", str(tmp_path / "r.json")) == 0
    file = tmp_path / "passes" / "indirect_0007.exr"
    assert [path.name for path in file.parent.iterdir()] == [file.name]
    assert channels(file)["Indirect.G"].mean() > 0.05
    report = json.loads((tmp_path / "r.json").read_text())
    assert report["files"] == [str(file)] and report["counts"]["camera_pixels"] == 24 * 16
    assert report["camera_settings"]["n_pixel_samples"] == 1 and report["objects"] == []


def test_one_solve_for_vertices_and_the_camera(empty_scene, tmp_path):
    """Both see the same light: that of the floor's middle."""
    build_room(empty_scene, (24, 16))
    assert bake(tmp_path, "--target", "vertex", "--report", str(tmp_path / "r.json")) == 0
    report = json.loads((tmp_path / "r.json").read_text())
    assert "Floor" in report["objects"] and len(report["files"]) == 1
    assert report["counts"]["receivers"] > report["counts"]["camera_points"]
    assert "Indirect" in bpy.data.objects["Floor"].data.color_attributes


def test_a_holdout_is_a_hole(empty_scene, tmp_path):
    """What is not in front of it stays as it was: light still falls on the holdout, and off it."""
    build_room(empty_scene, (12, 8))
    pictures = []
    for holdout in (False, True):
        bpy.data.objects["Back"].is_holdout = holdout
        assert bake(tmp_path) == 0
        pictures.append(channels(tmp_path / "indirect_0001.exr")["Indirect.G"])
    whole, cut = pictures
    hole = cut == 0
    assert (whole[hole] > 0.02).all()
    assert 0.2 < hole.mean() < 0.9
    np.testing.assert_allclose(cut[~hole].mean(), whole[~hole].mean(), rtol=0.2)


@pytest.mark.parametrize("tracer", ["embree", "multi_image"])
def test_where_nothing_gives_light_all_is_black(empty_scene, tmp_path, capfd, tracer):
    """As renders are there; a file that renders bakes."""
    build_room(empty_scene, (12, 8))
    bpy.data.objects.remove(bpy.data.objects["Lamp"])
    maps = ["--target", "lightmap", "--size", "32", "--denoise", "none"]
    assert bake(tmp_path, "--target", "vertex", *maps, "--tracer", tracer, "--maps", "1") == 0
    assert "warning: Nothing in the scene gives light" in capfd.readouterr().err
    assert not channels(tmp_path / "indirect_0001.exr")["Indirect.G"].any()
    light = bpy.data.objects["Floor"].data.attributes["Indirect"].data
    assert {tuple(one.color[:3]) for one in light} == {(0.0, 0.0, 0.0)}


def test_frames_of_an_animation(empty_scene, tmp_path):
    """The lamp goes out: each file has its frame's light, and the scene is at its own frame afterwards."""
    build_room(empty_scene, (12, 8))
    lamp = bpy.data.lights[0]
    for frame, energy in ((1, 30), (3, 0.3)):
        lamp.energy = energy
        lamp.keyframe_insert("energy", frame=frame)
    empty_scene.frame_set(5)
    assert bake(tmp_path, "--frames", "1-3", "--file-name", "light.##") == 0
    files = [tmp_path / f"light.{frame:02d}.exr" for frame in (1, 2, 3)]
    light = [channels(file)["Indirect.G"].mean() for file in files]
    assert light[0] > light[1] > light[2] > 0 and light[2] == pytest.approx(light[0] / 100, rel=0.1)
    assert empty_scene.frame_current == 5


def test_render_region_lies_in_the_frame(empty_scene, tmp_path):
    build_room(empty_scene, (20, 10))
    render = empty_scene.render
    render.use_border, render.border_min_x, render.border_max_x = True, 0.5, 1.0
    assert bake(tmp_path) == 0
    whole = channels(tmp_path / "indirect_0001.exr")
    assert whole["Depth.Z"].shape == (10, 20)
    assert not whole["Depth.Z"][:, :10].any() and whole["Depth.Z"][:, 10:].all()
    render.use_crop_to_border = True
    assert bake(tmp_path) == 0
    cropped = channels(tmp_path / "indirect_0001.exr")
    assert all(np.array_equal(cropped[name], values[:, 10:]) for name, values in whole.items())


def test_button_bakes_the_camera(empty_scene, tmp_path):
    build_room(empty_scene, (12, 8))
    properties = empty_scene.photon_bake
    properties.targets, properties.n_photons, properties.n_gather_rays = {"camera"}, 20_000, 16
    with pytest.raises(RuntimeError, match="never saved"):
        bpy.ops.photon_bake.bake_indirect()
    properties.camera.folder = str(tmp_path)
    assert bpy.ops.photon_bake.bake_indirect() == {"FINISHED"}
    assert (tmp_path / f"untitled_{empty_scene.name}_indirect_0001.exr").is_file()
    assert bpy.ops.photon_bake.add_pass() == {"FINISHED"}
    assert bpy.ops.photon_bake.remove_pass() == {"FINISHED"}


def test_same_seed_same_pass(empty_scene, tmp_path):
    build_room(empty_scene, (12, 8))
    for threads in ("1", "3"):
        assert bake(tmp_path / threads, "--threads", threads) == 0
    a, b = (channels(tmp_path / threads / "indirect_0001.exr") for threads in ("1", "3"))
    assert all(np.array_equal(a[name], b[name]) for name in a)


def glossy_back():
    """Give the wall that the camera sees a coat."""
    inputs = {"Roughness": 0.4, "Specular IOR Level": 0.5}
    material = coloured("Glossy", (0.8, 0.8, 0.8), "ShaderNodeBsdfPrincipled", **inputs)
    bpy.data.objects["Back"].data.materials[0] = material


def test_gloss_has_its_part_of_the_time(empty_scene, tmp_path):
    """What it shows is found before the final gather, which has what is left until the deadline."""
    build_room(empty_scene, (12, 8))
    glossy_back()
    assert bake(tmp_path, "--time", "0.01", "--report", str(tmp_path / "r.json")) == 0
    stages = list(json.loads((tmp_path / "r.json").read_text())["stage_seconds"])
    assert stages.index("Tracing photons") < stages.index("Following gloss") < stages.index("Gathering light")


@pytest.mark.parametrize("gather", ["final", "photon_volumes"])
def test_a_cancelled_bake_changes_nothing(empty_scene, tmp_path, gather):
    """At whatever stage: neither the old file nor Blender's data, and no other file is there."""
    build_room(empty_scene, (12, 8))
    glossy_back()
    file = tmp_path / "indirect_0001.exr"
    file.write_bytes(b"mine")
    settings = settings_for("draft", gather=gather, n_photons=5000, n_gather_rays=16, subsample=2)
    wanted = CameraRequest(CameraSettings(n_pixel_samples=1, file_name="indirect_####"), tmp_path)

    def names():
        return [sorted(things.keys()) for things in (bpy.data.meshes, bpy.data.images, bpy.data.node_groups)]

    def solve(progress):
        job = BakeJob.prepare(bpy.context, [wanted], progress)
        return job, job.solve(settings, progress)

    stages, before = [], names()
    solve(Progress(lambda stage, _: stages.append(stage)))
    for stage in dict.fromkeys(stages):
        progress = CancelsAt(stage)
        with pytest.raises(Cancelled):
            job, solved = solve(progress)
            job.write(solved, progress)
    assert len(set(stages)) > 6
    assert file.read_bytes() == b"mine" and list(tmp_path.iterdir()) == [file] and names() == before


@pytest.mark.parametrize("gather", ["light_volume", "density"])
def test_other_gathers(empty_scene, tmp_path, gather):
    build_room(empty_scene, (24, 16))
    assert bake(tmp_path / "final") == 0 and bake(tmp_path / gather, "--gather", gather) == 0
    a, b = (channels(tmp_path / name / "indirect_0001.exr")["Indirect.R"].mean() for name in ("final", gather))
    assert b == pytest.approx(a, rel=0.1)


def no_camera(scene):
    scene.camera = None


def empty_region(scene):
    scene.render.use_border, scene.render.border_min_x, scene.render.border_max_x = True, 0.5, 0.501


@pytest.mark.parametrize(
    ("spoil", "says"),
    [(no_camera, "no active camera"), (empty_region, "no pixel in it")],
)
def test_bad_scenes_fail_with_a_sentence(empty_scene, tmp_path, capfd, spoil, says):
    build_room(empty_scene, (12, 8))
    spoil(empty_scene)
    assert bake(tmp_path / "passes") == 1
    said = capfd.readouterr().err
    assert says in said and "Traceback" not in said
    assert not (tmp_path / "passes").exists()


def test_a_file_for_a_folder_fails_with_a_sentence(empty_scene, tmp_path, capfd):
    build_room(empty_scene, (12, 8))
    (tmp_path / "passes").write_text("mine")
    assert bake(tmp_path / "passes") == 1
    assert "is a file; give a folder" in capfd.readouterr().err
    (tmp_path / "indirect_0001.exr").mkdir()
    assert bake(tmp_path) == 1
    assert "is a folder; give the path of a file" in capfd.readouterr().err


def test_camera_that_sees_nothing_has_an_empty_pass(empty_scene, tmp_path, capfd):
    build_room(empty_scene, (12, 8)).rotation_euler = (1.5708, 0, 3.1416)
    assert bake(tmp_path) == 0
    assert "sees no surface" in capfd.readouterr().err
    empty = channels(tmp_path / "indirect_0001.exr")
    assert (empty.pop("Depth.Z") == 1e10).all()
    assert not any(values.any() for values in empty.values())


def test_camera_inside_a_wall_sees_its_dark_inside(empty_scene, tmp_path):
    add_camera(empty_scene, location=(0, 0, 0))
    add_cube("Wall")
    add_lamp("POINT", location=(0, 0, 3), energy=100)
    empty_scene.render.resolution_x, empty_scene.render.resolution_y = 12, 8
    assert bake(tmp_path) == 0
    dark = channels(tmp_path / "indirect_0001.exr")
    assert not dark["Indirect.G"].any() and dark["Depth.Z"] == pytest.approx(1, rel=1e-3)


def test_without_caustic_makers_there_are_no_caustics(empty_scene, tmp_path):
    build_room(empty_scene, (12, 8))
    assert bake(tmp_path) == 0
    assert not any(channels(tmp_path / "indirect_0001.exr")[f"Caustics.{c}"].any() for c in "RGB")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--target", "camera"], "--output DIR"),
        (["--target", "camera", "--output", "here", "--frames", "3-1"], "no frames"),
        (["--target", "camera", "--output", "here", "--frames", "all"], "no frames"),
        (["--target", "camera", "--output", "here", "--frames", "1-2:0.5"], "Subframes are for vertices alone"),
        (["--target", "camera", "--output", "here", "--pixel-samples", "0"], "n_pixel_samples"),
        (["--target", "camera", "--output", "here", "--precision", "double"], "--precision"),
        (["--target", "camera", "--output", "here", "--file-name", "a/b"], "file name"),
    ],
)
def test_bad_usage(arguments, says, capfd):
    assert run(arguments) == 2
    said = capfd.readouterr()
    assert said.out == "" and says in said.err
