"""The command photon_bake, in this process."""

import json
import os
import signal

import bpy  # isort: skip  (the module brings bmesh)
import bmesh
import numpy as np
import pytest
from photon_bake.operators.command_line.command import run
from photon_bake.operators.jobs.bake_job import BakeJob

from .scenes import add_cube, add_lamp, add_plane

QUICK = ["--quality", "draft", "--photons", "5000"]


@pytest.fixture(autouse=True)
def room(empty_scene):
    add_plane("Floor", size=8.0)
    add_cube("Box").location.z = 1.0
    add_lamp("POINT", location=(1.5, 0.5, 4), energy=1000)


def has_light(name, attribute="Indirect"):
    return attribute in bpy.data.objects[name].data.attributes


def test_bake_save_and_report(tmp_path, capfd):
    blend, report = tmp_path / "baked.blend", tmp_path / "r.json"
    options = ["--gather", "final", "--gather-rays", "16", "--seed", "3", "--threads", "1"]
    assert run([*QUICK, *options, "--save", str(blend), "--report", str(report)]) == 0
    said = capfd.readouterr()
    assert (
        "photon_bake" not in said.out
        and "photon_bake: Gathering light" in said.err
        and "photon_bake: Baked" in said.err
    )
    read = json.loads(report.read_text())
    assert read["status"] == "done" and read["saved"] == str(blend) and set(read["objects"]) == {"Floor", "Box"}
    assert read["settings"]["seed"] == 3 and read["settings"]["n_photons"] == 5000
    assert read["counts"]["receivers"] > 0 and read["peak_memory_mb"] > 50 and read["relative_noise"] > 0
    assert {"Reading the scene", "Tracing photons", "Saving"} <= set(read["stage_seconds"])
    assert 0 <= read["compile_seconds"] <= read["total_seconds"]
    assert {"blender", "python", "numpy", "scipy", "embreex", "numba", "photon_bake"} <= set(read["versions"])
    assert sorted(p.name for p in tmp_path.iterdir()) == ["baked.blend", "r.json"]
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    assert has_light("Floor") and has_light("Box")


def test_the_same_seed_gives_the_same_light():
    light = []
    for name, threads in (("A", "1"), ("B", "2")):
        assert run([*QUICK, "--attribute", name, "--threads", threads]) == 0
        values = np.empty(16, np.float32)
        bpy.data.objects["Floor"].data.attributes[name].data.foreach_get("color", values)
        light.append(values)
    assert np.array_equal(*light)


def test_only_the_objects_asked_for():
    assert run([*QUICK, "--objects", "Box", "--attribute", "Glow", "--gather", "density"]) == 0
    assert has_light("Box", "Glow") and not has_light("Floor", "Glow") and not has_light("Box")


def test_a_light_volume_is_filled(tmp_path, capfd):
    report = tmp_path / "r.json"
    assert run([*QUICK, "--gather", "light_volume", "--grid-cells", "12", "--report", str(report)]) == 0
    assert has_light("Box") and "photon_bake: Filling the volume" in capfd.readouterr().err
    read = json.loads(report.read_text())
    assert read["settings"]["gather"] == "light_volume" and read["settings"]["n_grid_cells"] == 12
    assert read["counts"]["volume_cells"] > 0


def test_noise_time_and_memory_are_in_the_report(tmp_path):
    report = tmp_path / "r.json"
    options = ["--noise", "0.05", "--time", "30", "--memory", "500", "--no-interpolation"]
    assert run([*QUICK, *options, "--report", str(report)]) == 0
    read = json.loads(report.read_text())
    asked = {"noise": 0.05, "time": 30.0, "memory": 500, "interpolate": False}
    assert {name: read["settings"][name] for name in asked} == asked
    assert read["relative_noise"] <= 0.05 and read["counts"]["gather_rays"] > 0


def test_light_is_fitted_to_faces_or_not(tmp_path):
    counts = []
    for options in ([], ["--no-fit"]):
        assert run([*QUICK, *options, "--report", str(tmp_path / "r.json")]) == 0
        counts.append(json.loads((tmp_path / "r.json").read_text())["counts"])
    fitted, sampled = counts
    assert fitted["face_samples"] > 0 and "face_samples" not in sampled
    assert fitted["receivers"] == sampled["receivers"], "both are the vertices that get light"


@pytest.mark.parametrize("gather", ["final", "density", "light_volume"])
def test_cube_maps_trace(gather, tmp_path, capfd):
    report = tmp_path / "r.json"
    options = ["--tracer", "multi_image", "--maps", "8", "--map-size", "16", "--gather", gather, "--gather-rays", "4"]
    assert run([*QUICK, *options, "--report", str(report)]) == 0
    assert has_light("Box") and "photon_bake: Taking cube maps" in capfd.readouterr().err
    read = json.loads(report.read_text())
    assert [read["settings"][name] for name in ("tracer", "n_maps", "map_size")] == ["multi_image", 8, 16]
    assert read["counts"]["cube_maps"] > 0 and read["counts"]["cube_map_bytes"] > 6 * 16**2


def test_save_goes_over_the_loaded_file(tmp_path):
    blend = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    assert run([*QUICK, "--save"]) == 0
    assert [p.name for p in tmp_path.iterdir()] == ["scene.blend"]
    assert bpy.data.filepath == str(blend)
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    assert has_light("Box")


def test_relative_paths_stay_right_in_another_folder(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    picture = bpy.data.images.new("Picture", 2, 2)
    picture.filepath_raw, picture.file_format = str(tmp_path / "picture.png"), "PNG"
    picture.save()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    picture.filepath = "//picture.png"
    picture.use_fake_user = True
    assert run([*QUICK, "--save", str(tmp_path / "elsewhere" / "baked.blend")]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "elsewhere" / "baked.blend"))
    found = os.path.normpath(bpy.path.abspath(bpy.data.images["Picture"].filepath))
    assert found == str(tmp_path / "picture.png")


def test_copies(tmp_path):
    blend = tmp_path / "scene.blend"
    bpy.data.objects["Box"].modifiers.new("Remesh", "REMESH").mode = "BLOCKS"
    assert run([*QUICK, "--copies", "--save", str(blend)]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    assert has_light("Box (Baked)") and not has_light("Box")
    assert bpy.data.objects["Box"].hide_render
    assert bpy.ops.photon_bake.remove_copies() == {"FINISHED"}
    assert not bpy.data.objects["Box"].hide_render


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--target", "lightmap"], "--output DIR"),
        (["--density", "8"], "--target lightmap"),
        (["--target", "lightmap", "--output", "maps", "--size", "99999"], "size"),
        (["--target", "lightmap", "--output", "maps", "--format", "jpeg"], "choose exr_half"),
        (["--target", "guess"], "choose vertex or lightmap or camera"),
        (["--tracer", "guess"], "choose embree or multi_image"),
        (["--gather", "guess"], "choose final or density or light_volume"),
        (["--quality", "best"], "quality"),
        (["--photons", "3"], "n_photons"),
        (["--photons", "many"], "--photons"),
        (["--noise", "2"], "noise"),
        (["--grid-cells", "1"], "n_grid_cells"),
        (["--maps", "0"], "n_maps"),
        (["--map-size", "5000"], "map_size"),
        (["--map-size", "100"], "map_size"),
        (["--map-size", "small"], "--map-size"),
        (["--output", "here"], "--output"),
        (["--objects", ","], "names"),
        (["--save"], "--save FILE.blend"),
        (["--copies", "--target", "camera", "--output", "maps"], "--target vertex or lightmap"),
        (["--no-fit", "--target", "lightmap", "--output", "maps"], "--target vertex"),
        (["--no-vertex-denoise", "--target", "lightmap", "--output", "maps"], "--target vertex"),
    ],
)
def test_bad_usage(arguments, says, capfd):
    assert run(arguments) == 2
    said = capfd.readouterr()
    assert said.out == "" and says in said.err
    assert not has_light("Box")


def test_help(capfd):
    assert run(["--help"]) == 0
    said = capfd.readouterr()
    assert said.err == ""
    for option in (
        "--objects",
        "--tracer",
        "--gather-rays",
        "--grid-cells",
        "--maps",
        "--map-size",
        "--direct",
        "--save",
        "--report",
        "130 cancelled",
    ):
        assert option in said.out


def test_a_wrong_name_fails_with_a_sentence_and_a_report(tmp_path, capfd):
    report = tmp_path / "r.json"
    assert run(["--objects", "Bx", "--report", str(report)]) == 1
    assert "photon_bake: " in (said := capfd.readouterr().err) and "Bx" in said and "Traceback" not in said
    read = json.loads(report.read_text())
    assert read["status"] == "failed" and "Bx" in read["message"]


def test_an_object_left_in_edit_mode_gets_the_light_of_what_it_holds(capfd):
    bpy.context.view_layer.objects.active = bpy.data.objects["Box"]
    bpy.ops.object.mode_set(mode="EDIT")
    edited = bmesh.from_edit_mesh(bpy.data.objects["Box"].data)
    bmesh.ops.subdivide_edges(edited, edges=edited.edges[:1], cuts=1)
    bmesh.update_edit_mesh(bpy.data.objects["Box"].data)
    assert run(QUICK) == 0
    assert "Box" not in capfd.readouterr().err and bpy.data.objects["Box"].mode == "EDIT"
    bpy.ops.object.mode_set(mode="OBJECT")
    assert has_light("Box") and has_light("Floor")


def test_a_wrong_light_group_fails_with_a_sentence(capfd):
    assert run([*QUICK, "--light-group", "Key"]) == 1
    said = capfd.readouterr().err
    assert "no light group 'Key'" in said and "Traceback" not in said


@pytest.mark.parametrize(
    ("name", "says"), [("missing.blend", "There is no file"), ("broken.blend", "cannot be opened by Blender")]
)
def test_a_named_file_that_is_not_open_is_not_replaced_by_blenders_own_scene(name, says, tmp_path, capfd, monkeypatch):
    """Blender goes on with its factory scene where the file of its command line cannot be opened."""
    (tmp_path / "broken.blend").write_text("no blend")
    blender = ["blender", "-b", str(tmp_path / "other.blend"), str(tmp_path / name), "-y"]
    monkeypatch.setattr("sys.argv", [*blender, "-c", "photon_bake", *QUICK])
    report = tmp_path / "r.json"
    assert run([*QUICK, "--save", "--report", str(report)]) == 1
    assert says in (said := capfd.readouterr().err) and str(tmp_path / name) in said and len(said.splitlines()) == 1
    assert json.loads(report.read_text())["status"] == "failed" and not has_light("Box")
    monkeypatch.setattr("sys.argv", ["blender", "-b", "--python", "scene.py", "--command", "photon_bake", *QUICK])
    assert run(QUICK) == 0


@pytest.mark.parametrize("option", ["--save", "--report"])
def test_an_unwritable_place_is_found_before_the_bake(tmp_path, option, capfd, monkeypatch):
    monkeypatch.setattr(BakeJob, "solve", lambda *_: pytest.fail("it baked"))
    assert run([*QUICK, option, str(tmp_path / "missing" / "file.blend")]) == 1
    said = capfd.readouterr().err.splitlines()
    assert len(said) == 1 and "cannot be written" in said[0]


def test_ctrl_c_cancels_and_its_handler_goes(tmp_path, monkeypatch, capfd):
    def solve(self, settings, progress, inspector=None, before=None, store=None):
        os.kill(os.getpid(), signal.SIGINT)
        for _ in range(1000):
            progress.update("Tracing photons", 0.5)
        pytest.fail("nobody cancelled")

    monkeypatch.setattr(BakeJob, "solve", solve)
    before, report = signal.getsignal(signal.SIGINT), tmp_path / "r.json"
    assert run([*QUICK, "--report", str(report), "--save", str(tmp_path / "x.blend")]) == 130
    assert signal.getsignal(signal.SIGINT) == before
    assert json.loads(report.read_text())["status"] == "cancelled"
    assert not (tmp_path / "x.blend").exists() and not has_light("Box")
    assert "Cancelled" in capfd.readouterr().err


def test_a_failed_save_leaves_the_file_as_it_was(tmp_path, monkeypatch, capfd):
    blend = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    before = blend.read_bytes()
    monkeypatch.setattr("photon_bake.addon.output.files.os.replace", lambda *_: (_ for _ in ()).throw(OSError("full")))
    assert run([*QUICK, "--save"]) == 1
    assert blend.read_bytes() == before and [p.name for p in tmp_path.iterdir()] == ["scene.blend"]


@pytest.mark.parametrize("name", ["Table, round", " space ", "-dash"])
def test_any_name_can_be_given(name):
    cube = add_cube("Cube")
    cube.name = name
    assert run([*QUICK, f"--object={name}", "--object", "Floor"]) == 0
    assert has_light(name) and has_light("Floor") and not has_light("Box")


def test_a_name_with_a_comma_counts_as_it_is_where_there_is_such_an_object():
    add_cube("Floor,Box")
    assert run([*QUICK, "--objects", "Floor,Box"]) == 0
    assert has_light("Floor,Box") and not has_light("Floor") and not has_light("Box")
    assert run([*QUICK, "--objects", "Floor", "--objects", "Box", "--attribute", "Both"]) == 0
    assert has_light("Floor", "Both") and has_light("Box", "Both")


def test_strict_fails_and_writes_nothing(tmp_path, capfd):
    report, saved = tmp_path / "r.json", tmp_path / "x.blend"
    bpy.data.objects["Box"].modifiers.new("Remesh", "REMESH").mode = "BLOCKS"
    arguments = [*QUICK, "--report", str(report), "--save", str(saved)]
    assert run([*arguments, "--strict"]) == 1
    read = json.loads(report.read_text())
    assert read["status"] == "failed" and read["message"].startswith("Strict, so nothing was written")
    assert not saved.exists() and not has_light("Floor")
    assert run(arguments) == 0
    read = json.loads(report.read_text())
    assert dict(zip(read["warnings"], read["warning_kinds"], strict=True))[read["warnings"][0]] == "difference"
    assert saved.exists() and "warning: " in capfd.readouterr().err


def test_a_file_that_cannot_be_saved_in_the_end_is_kept_elsewhere(tmp_path, monkeypatch, capfd):
    blend, report, refuge = tmp_path / "there" / "x.blend", tmp_path / "r.json", tmp_path / "refuge"
    blend.parent.mkdir()
    refuge.mkdir()

    def replace(source, target, real=os.replace):
        if target == blend:
            raise OSError(28, "No space left on device")
        real(source, target)

    monkeypatch.setattr("photon_bake.addon.output.files.os.replace", replace)
    monkeypatch.setattr("photon_bake.operators.command_line.command.mkdtemp", lambda prefix: str(refuge))
    assert run([*QUICK, "--save", str(blend), "--report", str(report)]) == 1
    read = json.loads(report.read_text())
    assert read["status"] == "failed" and read["saved"] == str(refuge / "x.blend")
    assert f"{blend} could not be saved (No space left on device)" in read["message"]
    assert read["message"].startswith("Baked ") and read["message"] in capfd.readouterr().err
    bpy.ops.wm.open_mainfile(filepath=str(refuge / "x.blend"))
    assert has_light("Floor")


def test_one_of_two_outputs_that_fails_is_said_and_the_rest_is_written(tmp_path, monkeypatch):
    report, saved = tmp_path / "r.json", tmp_path / "x.blend"

    def replace(source, target, real=os.replace):
        if str(target).endswith(".exr"):
            raise OSError(28, "No space left on device")
        real(source, target)

    monkeypatch.setattr("photon_bake.addon.output.files.os.replace", replace)
    targets = ["--target", "lightmap", "--target", "vertex", "--density", "4", "--output", str(tmp_path)]
    assert run([*QUICK, *targets, "--save", str(saved), "--report", str(report)]) == 1
    read = json.loads(report.read_text())
    assert read["status"] == "failed" and read["files"] == [] and read["saved"] == str(saved)
    assert "cannot be written (No space left on device)" in read["message"]
    assert has_light("Floor") and has_light("Box")


def test_a_file_name_that_is_too_long_is_found_before_the_bake(tmp_path, capfd, monkeypatch):
    monkeypatch.setattr(BakeJob, "solve", lambda *_: pytest.fail("it baked"))
    assert run([*QUICK, "--save", str(tmp_path / ("x" * 250 + ".blend"))]) == 1
    assert "too long for its folder" in capfd.readouterr().err


def test_a_long_file_name_that_fits_is_written(tmp_path):
    saved = tmp_path / ("ä" * 122 + "x.blend")
    assert len(os.fsencode(saved.name)) == 251
    assert run([*QUICK, "--save", str(saved)]) == 0
    assert [path.name for path in tmp_path.iterdir()] == [saved.name]


def test_a_time_that_cannot_hold_is_said(tmp_path, capfd):
    assert run([*QUICK, "--time", "0.001"]) == 0
    assert "instead of the 0.001 s" in capfd.readouterr().err
