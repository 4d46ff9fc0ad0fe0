"""A bake between its button and its light: cancelled, turned off, at odds with a scene that changed, half written."""

from threading import Event
from types import SimpleNamespace

import bpy
import photon_bake
import pytest
from photon_bake.addon.blender.lightmap import pieces
from photon_bake.addon.blender.read import scene_contents
from photon_bake.addon.core.errors import BakeError, Cancelled, kind_of
from photon_bake.addon.core.inspector import Inspector
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.settings.lightmap import LightmapSettings
from photon_bake.addon.ui.state import bake_state
from photon_bake.operators.jobs import solving
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.jobs.solving import TICK, Solver, Watch
from photon_bake.operators.jobs.written import Written
from photon_bake.operators.targets.lightmap import LightmapRequest
from photon_bake.operators.targets.vertices import AttributeSamples, VertexRequest

from .scenes import add_cube, add_material, add_plane, light_of


def test_a_cancelled_bake_changes_nothing(room, monkeypatch):
    def solve(self, settings, progress, inspector, before):
        progress.cancel()
        progress.update("Tracing photons", 0)

    monkeypatch.setattr(BakeJob, "solve", solve)
    assert bpy.ops.photon_bake.bake_indirect() == {"CANCELLED"}
    assert light_of("Box") is None and not bake_state.running and not bake_state.error


def test_reading_can_be_cancelled_at_any_time(room, tmp_path, monkeypatch):
    """Many instances, many meshes, materials: each is a step after which the reading may be told to stop."""
    # Waiting for a thread asks as often as it lasts; on this one each step is asked for once.
    monkeypatch.setattr(pieces, "aside", lambda function, check: function())
    monkeypatch.setattr(scene_contents, "_ROWS", 16)
    data = bpy.data.objects["Box"].data
    for i in range(20):
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
    def solve(self, settings, progress, inspector, before):
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

    def solve(job, settings, progress, inspector, before):
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
