"""Bake Indirect as a script calls it; the window's way is in tools/screenshot_panel.py."""

import sys
from threading import Event
from types import SimpleNamespace

import bpy
import numpy as np
import photon_bake
import pytest
from photon_bake.addon.core.errors import BakeError, Cancelled, TooCoarse, kind_of
from photon_bake.addon.core.inspector import Inspector
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.core.zips import LIBRARIES
from photon_bake.addon.settings.bake import CHOICES
from photon_bake.addon.settings.lightmap import LightmapSettings
from photon_bake.addon.ui.state import STAGE_SHARES, bake_state, share_done
from photon_bake.operators.jobs import solving
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.jobs.solving import TICK, Solver, Watch
from photon_bake.operators.jobs.written import Written
from photon_bake.operators.targets.lightmap import LightmapRequest
from photon_bake.operators.targets.vertices import AttributeSamples, VertexRequest

from .scenes import add_cube, add_lamp, add_material, add_plane

GATHERS = [gather for gather in CHOICES["gather"] if gather != "photon_volumes"]  # which is a camera's alone


@pytest.fixture
def room(empty_scene):
    """A cube on a floor under a lamp, and the smallest bake there is."""
    add_plane("Floor", size=8.0, smooth=True)
    cube = add_cube("Box")
    cube.location.z = 1.0
    add_lamp("POINT", location=(1.5, 0.5, 4), energy=1000)
    properties = bpy.context.scene.photon_bake
    properties.n_photons, properties.n_gather_rays = 5000, 16
    properties.n_cache_elements, properties.n_cache_rays = 200, 4
    return properties


def light_of(name, attribute="Indirect"):
    found = bpy.data.objects[name].data.attributes.get(attribute)
    if found is None:
        return None
    values = np.empty(len(found.data) * 4, np.float32)
    found.data.foreach_get("color", values)
    return values.reshape(-1, 4)


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


def test_a_cancelled_bake_changes_nothing(room, monkeypatch):
    def solve(self, settings, progress, inspector):
        progress.cancel()
        progress.update("Tracing photons", 0)

    monkeypatch.setattr(BakeJob, "solve", solve)
    assert bpy.ops.photon_bake.bake_indirect() == {"CANCELLED"}
    assert light_of("Box") is None and not bake_state.running and not bake_state.error


def test_reading_can_be_cancelled_at_any_time(room, tmp_path):
    """Many instances, many meshes, materials: each is a step after which the reading may be told to stop."""
    data = bpy.data.objects["Box"].data
    for i in range(300):
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(f"Box {i}", data))
    for i in range(5):
        add_plane(f"Plane {i}", material=add_material(f"Material {i}")[0])
    asked = []

    class CancelsAfter(Progress):
        def check(self):
            asked.append(1)
            if len(asked) > times:
                self.cancel()
            super().check()

    wanted, names = [LightmapRequest(LightmapSettings(density=1.0), tmp_path, "scene"), VertexRequest()], ["Floor"]
    names += [f"Plane {i}" for i in range(5)]
    times = 10_000
    BakeJob.prepare(bpy.context, wanted, CancelsAfter(), names)
    assert len(asked) > 25
    for times in range(0, len(asked), 3):
        asked.clear()
        with pytest.raises(Cancelled):
            BakeJob.prepare(bpy.context, wanted, CancelsAfter(), names)
        assert len(asked) == times + 1


def test_a_fault_of_ours_is_told_and_leaves_nothing_running(room, monkeypatch, capfd):
    def solve(self, settings, progress, inspector):
        raise ZeroDivisionError("by zero")

    monkeypatch.setattr(BakeJob, "solve", solve)
    with pytest.raises(RuntimeError, match="unexpectedly"):
        bpy.ops.photon_bake.bake_indirect()
    assert "Traceback" in capfd.readouterr().err
    assert not bake_state.running


def test_one_bake_at_a_time(room):
    bake_state.start("final")
    try:
        with pytest.raises(RuntimeError, match="A bake is running"):
            bpy.ops.photon_bake.bake_indirect()
        assert bpy.ops.photon_bake.cancel() == {"FINISHED"}
        assert bake_state.progress.cancelled
    finally:
        bake_state.stop()
    assert not bpy.ops.photon_bake.cancel.poll()


def test_a_thread_solves_and_can_be_stopped(room):
    progress = Progress()
    bake = BakeJob.prepare(bpy.context, [VertexRequest()], progress)
    solver = Solver(bake, room.settings(), progress, Inspector())
    solver.start()
    solver.join()
    solved = solver.solved()
    assert len(solved.outputs[0].receivers) == len(solved.irradiance.value) > 0
    progress.cancel()
    stopped = Solver(bake, room.settings(), progress, Inspector())
    stopped.start()
    stopped.join()
    with pytest.raises(Cancelled):
        stopped.solved()


def test_all_of_a_bake_keeps_to_the_memory(room, monkeypatch):
    given = []

    def finish(points, irradiance, workers):
        given.append(workers.memory)

    monkeypatch.setattr(AttributeSamples, "finish", finish)
    room.memory = 321
    bake = BakeJob.prepare(bpy.context, [VertexRequest()], Progress())
    bake.solve(room.settings(), Progress())
    assert given == [321]


class FakeContext:
    """A window's: its timers, and the operators that it runs."""

    def __init__(self):
        self.window_manager, self.window, self.timers = self, self, []

    def event_timer_add(self, tick, window):
        assert tick == TICK and window is self
        self.timers.append(object())
        return self.timers[-1]

    def event_timer_remove(self, timer):
        self.timers.remove(timer)


def test_turned_off_while_a_bake_runs_in_a_window(room, monkeypatch):
    """Its thread ends, its timer goes, and the panel forgets it; turned on again, it bakes."""
    begun, context = Event(), FakeContext()

    def solve(job, settings, progress, inspector):
        while True:
            begun.set()
            progress.update("Tracing photons", 0)

    with monkeypatch.context() as slow:
        slow.setattr(BakeJob, "solve", solve)
        progress = bake_state.start("final")
        solver = Solver(BakeJob.prepare(bpy.context, [VertexRequest()], progress), None, progress, Inspector())
        watch = Watch(solver, context)
        assert begun.wait(10) and watch.alive and context.timers
        slow.setattr(solving, "bpy", SimpleNamespace(context=context))
        photon_bake.unregister()
    try:
        assert not solver.is_alive() and not context.timers and not bake_state.running
        with pytest.raises(Cancelled):
            solver.solved()
        watch.end(context)  # a second time is nothing
    finally:
        photon_bake.register()
    assert bpy.ops.photon_bake.bake_indirect() == {"FINISHED"}


def test_a_mesh_edited_meanwhile_is_left_out_alone(room):
    progress = Progress()
    bake = BakeJob.prepare(bpy.context, [VertexRequest()], progress)
    light = bake.solve(room.settings(), progress)
    bpy.data.objects["Floor"].data.vertices.add(1)
    bpy.data.objects["Lamp"].location.x += 1
    bpy.context.view_layer.update()
    assert bake.write(light, progress).failures == []
    assert light_of("Floor") is None and light_of("Box")[:, :3].max() > 0
    moved, changed = (warning for warning in bake.warnings if kind_of(warning) == "difference")
    assert "'Floor' got no light, since its mesh was changed" in changed
    assert "Light is that of where object 'Lamp' stood" in moved


def test_undo_and_other_names_are_harmless(room):
    """Undo makes all data-blocks anew; here a renamed object stands for that, and a name that another one took."""
    progress = Progress()
    bake = BakeJob.prepare(bpy.context, [VertexRequest()], progress)
    light = bake.solve(room.settings(), progress)
    bpy.data.objects["Floor"].name = "Ground"
    add_cube("Floor")
    bake.write(light, progress)
    assert light_of("Ground") is not None and light_of("Floor") is None
    assert not any(kind_of(warning) == "difference" for warning in bake.warnings)


class Broken:
    """A product that cannot be written."""

    files, counts = [], {}

    def __init__(self, error=None):
        self.error = error or BakeError("The disk is full.")

    def concerns(self):
        return []

    def write(self):
        raise self.error


class CancelledInTime:
    """A product during whose writing the user cancels: too late."""

    files, counts = [], {}

    def concerns(self):
        return []

    def write(self):
        bake_state.cancel()
        return Written()


def solved_with(monkeypatch, product):
    """Have bakes make one more product."""
    solve = BakeJob.solve

    def with_product(*at):
        solved = solve(*at)
        solved.outputs.insert(0, product)
        return solved

    monkeypatch.setattr(BakeJob, "solve", with_product)


def test_what_is_written_is_not_cancelled(room, monkeypatch):
    solved_with(monkeypatch, CancelledInTime())
    assert bpy.ops.photon_bake.bake_indirect() == {"FINISHED"}
    assert light_of("Box")[:, :3].max() > 0


def test_a_fault_of_ours_in_one_output_keeps_no_other_from_being_written(room, monkeypatch, capfd):
    solved_with(monkeypatch, Broken(ZeroDivisionError("by zero")))
    with pytest.raises(RuntimeError, match=r"unexpectedly.*The rest was written\."):
        bpy.ops.photon_bake.bake_indirect()
    assert "Traceback" in capfd.readouterr().err and light_of("Box")[:, :3].max() > 0


def test_one_of_two_outputs_that_fails_is_said_and_the_other_is_written(room, monkeypatch):
    solved_with(monkeypatch, Broken())
    with pytest.raises(RuntimeError, match=r"The disk is full\. The rest was written\."):
        bpy.ops.photon_bake.bake_indirect()
    assert light_of("Box")[:, :3].max() > 0 and "points in" in bake_state.result
    assert bake_state.error == "The disk is full." and not bake_state.running


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
