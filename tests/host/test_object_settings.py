"""Settings of single objects: what they change, and how they are copied."""

import json

import bpy
import pytest
from photon_bake.addon.blender.overrides import density_factors
from photon_bake.addon.ui.state import bake_state
from photon_bake.operators.command_line.command import run

from .scenes import add_cube, add_lamp, add_plane

QUICK = ["--quality", "draft", "--photons", "5000"]


@pytest.fixture(autouse=True)
def room(empty_scene):
    add_plane("Floor", size=4.0)
    add_cube("Box").location.z = 1.0
    add_lamp("POINT", location=(3.0, 0.5, 2), energy=1000)


def has_light(name):
    return "Indirect" in bpy.data.objects[name].data.attributes


def test_an_excluded_object_gets_no_light_and_reflects_as_before():
    bpy.data.objects["Box"].photon_bake.exclude = True
    assert run([*QUICK, "--gather-rays", "1024"]) == 0
    light = [value.color[0] for value in bpy.data.objects["Floor"].data.attributes["Indirect"].data]
    assert not has_light("Box") and max(light) > 0  # the box alone sends it


def test_the_report_says_who_is_excluded(tmp_path):
    bpy.data.objects["Box"].photon_bake.exclude = True
    assert run([*QUICK, "--objects", "Floor,Box", "--strict", "--report", str(tmp_path / "r.json")]) == 0
    read = json.loads((tmp_path / "r.json").read_text())
    assert read["objects"] == ["Floor"]
    assert "1 object(s) are excluded by their own settings ('Box')." in read["warnings"]


@pytest.mark.parametrize("target", ["vertex", "lightmap"])
def test_all_excluded_is_refused(target, tmp_path, capfd):
    for name in ("Box", "Floor"):
        bpy.data.objects[name].photon_bake.exclude = True
    assert run([*QUICK, "--target", target, *(["--output", str(tmp_path)] if target == "lightmap" else [])]) == 1
    assert "all objects are excluded by their own settings" in capfd.readouterr().err


def test_a_mesh_that_one_of_its_objects_keeps_is_not_refined():
    twin = bpy.data.objects.new("Twin", bpy.data.objects["Floor"].data)
    bpy.context.scene.collection.objects.link(twin)
    twin.photon_bake.refine = "never"
    with pytest.raises(RuntimeError, match="Object 'Floor' keeps its mesh by its own setting"):
        bpy.ops.photon_bake.refine(objects=[{"name": "Floor"}])
    assert not bake_state.running


def test_density_factors_are_by_name():
    bpy.data.objects["Box"].photon_bake.density = 2.0
    assert density_factors(bpy.data.objects) == {"Box": 2.0}


def test_settings_are_copied_to_what_is_selected():
    floor, box = bpy.data.objects["Floor"], bpy.data.objects["Box"]
    box.photon_bake.exclude, box.photon_bake.density, box.photon_bake.refine = True, 0.5, "never"
    bpy.context.view_layer.objects.active = box
    assert not bpy.ops.photon_bake.copy_object_settings.poll()
    floor.select_set(True)
    assert bpy.ops.photon_bake.copy_object_settings() == {"FINISHED"}
    settings = floor.photon_bake
    assert (settings.exclude, settings.density, settings.refine) == (True, 0.5, "never")


def test_settings_are_saved_with_the_file(tmp_path):
    bpy.data.objects["Box"].photon_bake.density = 4.0
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    assert bpy.data.objects["Box"].photon_bake.density == 4.0
