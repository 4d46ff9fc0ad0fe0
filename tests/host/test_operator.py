"""Bake Indirect as a script calls it; the window's way is in tools/screenshot_panel.py."""

import sys

import bpy
import numpy as np
import pytest
from photon_bake.addon.core.errors import TooCoarse, kind_of
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.core.zips import LIBRARIES
from photon_bake.addon.settings.bake import CHOICES
from photon_bake.addon.ui.state import STAGE_SHARES, bake_state, share_done
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.remedy import _DO
from photon_bake.operators.targets.vertices import VertexRequest

from .scenes import add_cube, add_lamp, add_material, add_plane, light_of

GATHERS = [gather for gather in CHOICES["gather"] if gather != "photon_volumes"]  # which is a camera's alone


def test_a_script_bakes_to_the_end(room):
    assert bpy.ops.photon_bake.bake_indirect() == {"FINISHED"}
    light = light_of("Box")
    assert np.isfinite(light).all() and light[:, :3].max() > 0
    assert bpy.data.objects["Floor"].data.color_attributes.active_color.name == "Indirect"
    assert not bake_state.running and "points in" in bake_state.result and not bake_state.error


@pytest.mark.parametrize("gather", GATHERS)
def test_the_progress_bar_knows_every_stage(room, gather):
    shown, done = {}, []

    def listen(stage, fraction):
        shown[stage] = fraction
        done.append(share_done(STAGE_SHARES[gather], shown))

    progress = Progress(listen)
    room.gather, room.add_direct = gather, True
    bake = BakeJob.prepare(bpy.context, [VertexRequest()], progress)
    bake.solve(room.settings(), progress)
    assert set(STAGE_SHARES[gather]) <= set(shown)
    assert done == sorted(done) and done[-1] == pytest.approx(1)


@pytest.mark.parametrize("gather", GATHERS)
def test_every_gather_lights_the_scene(room, gather):
    room.gather = gather
    assert bpy.ops.photon_bake.bake_indirect() == {"FINISHED"}
    light = light_of("Box")
    assert np.isfinite(light).all() and light[:, :3].max() > 0


def test_photon_volumes_are_for_a_camera(room):
    room.gather = "photon_volumes"
    with pytest.raises(RuntimeError, match="bake to Camera alone, or choose another Gather"):
        bpy.ops.photon_bake.bake_indirect()
    assert light_of("Box") is None


def test_cube_maps_light_the_scene(room):
    room.tracer, room.n_maps, room.map_size = "multi_image", 8, 16
    assert bpy.ops.photon_bake.bake_indirect() == {"FINISHED"}
    light = light_of("Box")
    assert np.isfinite(light).all() and light[:, :3].max() > 0


def test_a_wide_face_among_small_ones_is_said_to_be_too_coarse(room):
    room.n_gather_rays = 256
    bpy.ops.photon_bake.bake_indirect()
    said = [warning for warning in bake_state.warnings if isinstance(warning, TooCoarse)]
    assert [one.names[0] for one in said] == ["Floor"] and kind_of(said[0]) == "advice"  # and the box, by noise


def test_selected_only(room):
    room.selected_only = True
    for thing in bpy.context.view_layer.objects:
        thing.select_set(thing.type == "LIGHT")
    with pytest.raises(RuntimeError, match="No mesh object is selected"):
        bpy.ops.photon_bake.bake_indirect()
    bpy.data.objects["Box"].select_set(True)
    assert bpy.ops.photon_bake.bake_indirect() == {"FINISHED"}
    assert light_of("Box") is not None and light_of("Floor") is None


def test_add_direct_adds(room):
    bpy.ops.photon_bake.bake_indirect()
    room.add_direct, room.attribute = True, "All"
    bpy.ops.photon_bake.bake_indirect()
    assert light_of("Floor", "All")[:, :3].mean() > light_of("Floor")[:, :3].mean()


@pytest.mark.parametrize("library", LIBRARIES)
def test_without_a_library_a_bake_says_what_to_install(room, monkeypatch, library):
    monkeypatch.setitem(sys.modules, LIBRARIES[library], None)
    with pytest.raises(
        RuntimeError, match=f"{library}, which every bake needs, .*: remove Photon Bake, .*, and install"
    ):
        bpy.ops.photon_bake.bake_indirect()
    assert light_of("Box") is None


def test_a_scene_that_cannot_be_baked_is_refused_in_a_sentence(room):
    for name in ("Floor", "Box"):
        bpy.data.objects[name].hide_render = True
    with pytest.raises(RuntimeError, match="no mesh object that renders show"):
        bpy.ops.photon_bake.bake_indirect()
    assert bake_state.error and not bake_state.running
    assert light_of("Box") is None


def test_strict_writes_nothing_where_light_differs(room):
    room.strict = True
    add_cube("Twin").location.x = 3
    bpy.data.objects["Twin"].data = bpy.data.objects["Box"].data
    with pytest.raises(RuntimeError, match=r"Strict, so nothing was written.*shared by"):
        bpy.ops.photon_bake.bake_indirect()
    assert light_of("Floor") is None and bake_state.error
    room.strict = False
    assert bpy.ops.photon_bake.bake_indirect() == {"FINISHED"}


def test_strict_allows_advice(room):
    room.strict = True
    add_lamp("AREA", "Flat", scale=(0, 0, 0))
    assert bpy.ops.photon_bake.bake_indirect() == {"FINISHED"}
    assert any("no area" in warning for warning in bake_state.warnings)


def test_strict_is_found_before_the_work(room, monkeypatch):
    room.strict = True
    bpy.data.objects["Box"].modifiers.new("Bevel", "BEVEL")
    image = bpy.data.images.new("Gone", 2, 2)
    image.source, image.filepath = "FILE", "//gone.png"
    material, surface = add_material("Paper")
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.links.new(node.outputs[0], surface.inputs[0])
    bpy.data.objects["Floor"].data.materials.append(material)
    monkeypatch.setattr(BakeJob, "solve", lambda *_: pytest.fail("it baked"))
    with pytest.raises(RuntimeError, match="Strict, so nothing was written"):
        bpy.ops.photon_bake.bake_indirect()


def test_selected_only_says_nothing_of_a_camera(room, tmp_path):
    bpy.ops.object.camera_add(location=(0, -8, 3), rotation=(1.2, 0, 0))
    bpy.context.scene.camera = bpy.context.object
    bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = 8
    room.selected_only, room.targets, room.camera.folder = True, {"camera"}, str(tmp_path)
    bpy.ops.object.select_all(action="DESELECT")
    assert bpy.ops.photon_bake.bake_indirect() == {"FINISHED"}


def outward_room():
    """A room whose walls' normals look out of it."""
    for name in ("Floor", "Box"):
        bpy.data.objects.remove(bpy.data.objects[name])
    bpy.data.objects["Lamp"].location = (0, 0, 0)
    return add_cube("Room")


def test_an_object_that_turns_its_back_to_the_light_is_named(room):
    outward_room()
    bpy.ops.photon_bake.bake_indirect()
    assert light_of("Room")[:, :3].max() == 0
    (warning,) = (one for one in bake_state.warnings if "turns its back" in one)
    assert "'Room'" in warning and "Open Side" in warning and kind_of(warning) == "advice"
    room.open_side = True
    bpy.ops.photon_bake.bake_indirect()
    assert light_of("Room")[:, :3].min() > 0
    assert not any("turns its back" in warning for warning in bake_state.warnings)


def test_a_closed_body_that_is_inside_out_is_named_and_mended(room):
    """Its inside is dark, as in Cycles' bake; Open Side bakes what is seen, and the remedy turns its normals."""
    box = bpy.data.objects["Box"]
    bpy.ops.photon_bake.bake_indirect()
    outside = light_of("Box")[:, :3].mean()
    box.data.flip_normals()
    bpy.ops.photon_bake.bake_indirect()
    assert light_of("Box")[:, :3].max() == 0
    (warning,) = (one for one in bake_state.warnings if "inside out" in one)
    assert "'Box'" in warning and "Recalculate Outside" in warning and kind_of(warning) == "advice"
    room.open_side = True
    bpy.ops.photon_bake.bake_indirect()
    assert light_of("Box")[:, :3].mean() == pytest.approx(outside, rel=0.1)
    room.open_side = False
    _DO["recalculate_outside"](bpy.context, [box])
    bpy.ops.photon_bake.bake_indirect()
    assert light_of("Box")[:, :3].mean() == pytest.approx(outside, rel=0.1)
    assert not any("inside out" in warning for warning in bake_state.warnings)


@pytest.mark.parametrize("apart, n", [(0.0, 1), (1e-3, 0)])
def test_emissive_faces_in_the_plane_of_others_are_named(room, apart, n):
    """Cycles' light depends on rounding there, and is what was baked a millimetre in front."""
    glow, _ = add_material("Glow", "ShaderNodeEmission")
    add_plane("Panel", material=glow).location = (2.5, 0, apart)
    bpy.ops.photon_bake.bake_indirect()
    warnings = [one for one in bake_state.warnings if "one plane" in one]
    assert len(warnings) == n
    for warning in warnings:
        assert "'Panel'" in warning and "'Floor'" in warning and kind_of(warning) == "difference"
