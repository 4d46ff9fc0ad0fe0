"""The switch of live light: what it leaves behind, and what it says."""

import threading
import weakref
from types import SimpleNamespace

import bpy
import pytest
from photon_bake.addon.blender.viewport.session import LiveSession
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.ui import live as module
from photon_bake.addon.ui.live import NO_WINDOW, live_switch
from photon_bake.addon.ui.panels import live as panel
from photon_bake.addon.ui.state import bake_state

from .leftovers import differences, snapshot
from .live_stand_ins import Engine, light_on
from .scenes import add_cube, add_lamp, add_plane


@pytest.fixture
def scene(empty_scene, monkeypatch):
    """A cube and a floor under a lamp, in a Blender that seems to have a window."""
    monkeypatch.setattr(LiveSession, "_started", lambda self: Engine(self._stages[-1].surfaces))
    empty_scene.photon_bake.live.n_vertices = 200
    app = SimpleNamespace(
        background=False, timers=bpy.app.timers, handlers=bpy.app.handlers, is_job_running=lambda name: False
    )
    monkeypatch.setattr(module, "bpy", SimpleNamespace(app=app, context=bpy.context, types=bpy.types, data=bpy.data))
    fill()
    yield bpy.context.scene
    live_switch.turn_off()


def fill():
    add_plane("Floor", size=8.0)
    add_cube("Box").location.z = 1.0
    add_lamp("POINT", location=(1.5, 0.5, 4), energy=1000)
    bpy.context.view_layer.update()


def turn_on():
    live_switch.turn_on(bpy.context.scene, bpy.context.view_layer)
    return live_switch.session


def test_without_a_window_it_says_so(empty_scene):
    fill()
    with pytest.raises(RuntimeError, match="no window"):
        bpy.ops.photon_bake.live()
    assert not live_switch.on and live_switch.error == NO_WINDOW
    live_switch.error = ""


def test_it_waits_for_kernels_that_are_compiled_ahead(scene, monkeypatch):
    monkeypatch.setattr(module, "compiler", SimpleNamespace(running=True))
    assert turn_on() is None and live_switch.on and live_switch.words == module.COMPILING
    live_switch.tick()
    assert live_switch.session is None
    module.compiler.running = False
    live_switch.tick()
    assert live_switch.session is not None and live_switch.words != module.COMPILING


def test_it_leaves_nothing_behind(scene):
    before, threads = snapshot(), threading.active_count()
    session = turn_on()
    assert live_switch.on and bpy.app.timers.is_registered(module._tick)
    assert snapshot()["handlers"] != before["handlers"]
    live_switch.tick()
    bpy.ops.photon_bake.live()
    assert not live_switch.on and live_switch.session is None and not session.live.running
    alive = weakref.ref(session)
    del session
    assert alive() is None
    assert not bpy.app.timers.is_registered(module._tick) and threading.active_count() == threads
    assert differences(before, snapshot()) == []


def test_a_scene_without_light_stays_as_it_was(scene):
    bpy.data.objects.remove(next(obj for obj in bpy.data.objects if obj.type == "LIGHT"))
    before = snapshot()
    with pytest.raises(RuntimeError, match="Nothing in the scene gives light"):
        bpy.ops.photon_bake.live()
    assert not live_switch.on and differences(before, snapshot()) == []


def test_changes_reach_the_engine_by_the_handlers(scene):
    session = turn_on()
    next(obj for obj in bpy.data.objects if obj.type == "LIGHT").location.x = 3
    bpy.context.view_layer.update()
    assert live_switch.tick() == module._AWAKE and session.live.told() == ["LampsChanged"]


def test_it_rests_when_light_has_converged(scene):
    session = turn_on()
    session.live.light = light_on(session.live.light.surfaces, version=7, converged=True)
    live_switch.tick()
    assert live_switch.tick() == module._ASLEEP


def test_another_file_is_live_too_if_it_has_light(scene, tmp_path):
    path = str(tmp_path / "lit.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    first = turn_on()
    bpy.ops.wm.open_mainfile(filepath=path)
    assert live_switch.on and live_switch.session is None and not first.live.running
    live_switch.tick()
    assert live_switch.session is not None and live_switch.session is not first
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    live_switch.tick()
    assert not live_switch.on and "Nothing in the scene gives light" in live_switch.error


def test_undo_leaves_it_on(scene):
    bpy.ops.ed.undo_push(message="Start")
    session = turn_on()
    bpy.context.scene.objects["Box"].location.x = 2
    bpy.ops.ed.undo_push(message="Moved")
    live_switch.tick()
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    session._ready = 0.0
    live_switch.tick()
    assert live_switch.session is session and (session.scenery().transforms[:, 0, 3] == 0).all()


def test_it_pauses_while_something_bakes(scene):
    session = turn_on()
    bake_state.progress = object()
    try:
        live_switch.tick()
        assert not session.live.running and "Paused" in live_switch.words
    finally:
        bake_state.progress = None
    live_switch.tick()
    assert session.live.running


def test_what_fails_while_drawing_turns_it_off(scene):
    turn_on()
    live_switch._fails(BakeError("The graphics driver does not compile it."))
    live_switch.tick()
    assert not live_switch.on and live_switch.error == "The graphics driver does not compile it."


def test_a_line_says_how_far_light_is(scene):
    session = turn_on()
    surfaces = session.live.light.surfaces
    for light, words in (
        (None, "Finding the first light"),
        (light_on(surfaces, error=float("inf")), "Indirect light not known yet"),
        (light_on(surfaces, error=0.123), "Indirect light within 12.3%"),
        (light_on(surfaces, error=0.01, converged=True), "Indirect light within 1.0%, converged"),
    ):
        session.live.light = light
        assert live_switch.words == words
    next(obj for obj in bpy.data.objects if obj.type == "LIGHT").location.x = 3
    bpy.context.view_layer.update()
    live_switch.tick()
    assert live_switch.words.endswith(" behind")


def test_panels_are_drawn_again_when_the_line_is_another(scene, monkeypatch):
    drawn = []
    monkeypatch.setattr(module, "redraw_panels", lambda context: drawn.append(live_switch.words))
    monkeypatch.setattr(module, "_PANEL", 0.0)
    session = turn_on()
    live_switch.tick()
    for version, error in ((8, 0.1), (9, 0.1), (10, 0.05)):
        session.live.light = light_on(session.live.light.surfaces, version=version, error=error)
        live_switch.tick()
    assert drawn[-2:] == ["Indirect light within 10.0%", "Indirect light within 5.0%"]


def test_the_mode_is_nothing_that_a_file_keeps(scene, tmp_path):
    manager = bpy.context.window_manager
    manager.photon_bake_live_mode = "light"
    assert live_switch.mode == "light" and manager.photon_bake_live_mode == "light"
    assert "photon_bake_live_mode" not in manager.keys()  # noqa: SIM118
    manager.photon_bake_live_mode = "colored"


def test_the_panel_draws_in_each_state(scene):
    class Layout:
        def __getattr__(self, name):
            return lambda *_, **__: self

    for prepare in (lambda: None, turn_on, live_switch.turn_off, lambda: setattr(live_switch, "error", "It failed.")):
        prepare()
        panel.draw_live(Layout(), bpy.context, 30)
        panel.draw_in_view_menu(SimpleNamespace(layout=Layout()), bpy.context)
    live_switch.error = ""
