"""What live light, bake, show, hide, remove, undo and disable leave behind in a Blender with a window: nothing.

    blender --factory-startup --python tests/bench/window_leftovers.py

Data-blocks with their users, node trees, settings, handlers, viewports and files are compared before and after. Prints
what differs, and ends with status 1 if anything does. Needs the extension's libraries in Blender's Python, as
`python tools/install_zip.py --tests BLENDER` lays them out, and a display (Xvfb does).
"""

import os
import sys
import tempfile
import threading
import traceback
from pathlib import Path
from time import perf_counter

import bpy

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / ".venv" / "src"), str(ROOT)]

import photon_bake  # noqa: E402
from photon_bake.addon.ui.live import live_switch  # noqa: E402
from photon_bake.addon.ui.state import bake_state  # noqa: E402

from tests.host.leftovers import differences, handlers, snapshot, views  # noqa: E402

failures = []


def check(what, before, after):
    """Say whether two snapshots are equal."""
    found = differences(before, after)
    failures.extend(found)
    print(f"{what}: {found or 'equal'}", flush=True)


def steps(folder):
    """The steps; each yield lets Blender run on."""
    without = handlers()
    photon_bake.register()
    scene = make_scene(folder)
    call(bpy.ops.ed.undo_push, message="Start")
    yield
    empty = snapshot(folder)
    yield from live()
    check("live", empty, snapshot(folder))
    yield from bake()
    for once in (True, False):  # Undo would not bring back the files
        yield from bake()
        assert once == any("written over" in warning for warning in bake_state.warnings)
    baked = snapshot(folder)
    run(bpy.ops.photon_bake.use_baked_light)
    yield
    assert "VERTEX" in views()[0]
    assert scene_now().cycles.diffuse_bounces == 0
    shown = snapshot(folder)
    run(bpy.ops.photon_bake.leave_baked_light)
    yield
    check("show and hide", baked, snapshot(folder))
    call(bpy.ops.ed.undo)
    yield
    check("undo of hide", {**shown, "views": None}, {**snapshot(folder), "views": None})
    call(bpy.ops.ed.undo)
    yield
    check("undo of show", baked, snapshot(folder))
    run(bpy.ops.photon_bake.use_baked_light)
    yield
    run(bpy.ops.photon_bake.leave_baked_light)
    run(bpy.ops.photon_bake.remove_lightmaps, files=True)
    for mesh in bpy.data.meshes:
        mesh.attributes.remove(mesh.attributes["Indirect"])
        mesh.attributes.active_color_name = ""
    yield
    check("remove", empty, snapshot(folder))
    call(bpy.ops.ed.undo_push, message="Removed")
    yield from bake()
    call(bpy.ops.ed.undo)
    yield
    check("undo of a bake", {**empty, "files": None}, {**snapshot(folder), "files": None})
    yield from bake()
    run(bpy.ops.photon_bake.use_baked_light)
    run(bpy.ops.photon_bake.leave_baked_light)
    photon_bake.unregister()
    check("disable", {"handlers": without}, {"handlers": handlers()})
    assert not hasattr(bpy.types.Scene, "photon_bake")
    del scene


def make_scene(folder):
    """Two objects under a lamp, and a quick bake of both kinds."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=False)
    scene = bpy.context.scene
    properties = scene.photon_bake
    properties.quality, properties.targets = "draft", {"vertex", "lightmap"}
    properties.n_photons, properties.gather, properties.lightmap.density = 2000, "density", 2.0
    properties.lightmap.folder = str(folder)
    call(bpy.ops.mesh.primitive_plane_add, size=8.0)
    bpy.ops.object.select_all(action="DESELECT")
    return scene


def scene_now():
    """The scene; an undo makes all references stale."""
    return bpy.context.window_manager.windows[0].scene


def call(operator, *arguments, **options):
    """Call an operator as in the 3D view."""
    window = bpy.context.window_manager.windows[0]
    area = next(one for one in window.screen.areas if one.type == "VIEW_3D")
    region = next(one for one in area.regions if one.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        return operator(*arguments, **options)


def run(operator, **options):
    """Call an operator that makes a step of undo."""
    assert call(operator, "EXEC_DEFAULT", True, **options) == {"FINISHED"}


def live():
    """Live light on, until it has been drawn, and off."""
    threads = threading.active_count()
    call(bpy.ops.photon_bake.live)
    end = perf_counter() + 300
    while perf_counter() < end and live_switch.on and not (live_switch.session and live_switch.session.light):
        yield
    for lamp in (obj for obj in bpy.data.objects if obj.type == "LIGHT"):
        lamp.location = lamp.location  # an edit that changes nothing
    yield
    print("live:", live_switch.words, live_switch.error, flush=True)
    assert live_switch.on
    call(bpy.ops.photon_bake.live)
    yield
    assert not live_switch.on and threading.active_count() <= threads


def bake():
    """Bake by the button's way, and wait for the end."""
    call(bpy.ops.photon_bake.bake_indirect, "INVOKE_DEFAULT")
    end = perf_counter() + 120
    while bake_state.running and perf_counter() < end:
        yield
    yield
    print(bake_state.result, bake_state.error, bake_state.warnings, flush=True)
    assert bake_state.result


def main():
    """Play the steps from Blender's timer, and leave."""
    folder = tempfile.TemporaryDirectory()
    playing = steps(Path(folder.name))

    def tick():
        try:
            next(playing)
        except StopIteration:
            leave(1 if failures else 0)
        except BaseException:
            traceback.print_exc()
            leave(1)
        return 0.2

    def leave(status):
        folder.cleanup()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)

    bpy.app.timers.register(tick, first_interval=1.0, persistent=True)


main()
