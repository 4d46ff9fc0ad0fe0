"""Random edits for a while in a window with live light: no exception, no leak, and the light of a fresh start.

    blender --factory-startup --window-geometry 0 0 500 400 --python tests/bench/window_live.py -- [MINUTES SEED [off]]

Moves, colors, adding, deleting, renaming, hiding, edit mode, undo and redo, frames, files and the switch itself, as
they come. After each tenth but the last the first file is opened again, so that the memory printed then is of one and
the same scene; allocators give back first what nothing uses. Prints how many edits of each kind there were, exceptions,
and how late Blender's timer came; then how far the light is from that of live light that is turned on anew, and of both
from a bake at High. With `off` live light stays off, and memory is Blender's own. Ends with status 1 where something
went wrong. Needs the extension's libraries in Blender's Python, as `python tools/install_zip.py --tests BLENDER` lays
them out, and a display. Where Blender takes memory from oneTBB (`ldd`), with LD_PRELOAD=libc.so.6 it is the system's,
whose fragments are fewer.
"""

import ctypes
import gc
import os
import random
import sys
import tempfile
import threading
import traceback
from collections import Counter
from pathlib import Path
from time import perf_counter

import bpy
import numpy as np
from scipy.spatial import cKDTree

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / ".venv" / "src"), str(ROOT)]

import photon_bake  # noqa: E402
from photon_bake.addon.pipeline.bake import bake  # noqa: E402
from photon_bake.addon.pipeline.warm_up import compiler  # noqa: E402
from photon_bake.addon.settings.bake import settings_for  # noqa: E402
from photon_bake.addon.tracing.embree import EmbreeTracer  # noqa: E402
from photon_bake.addon.ui.live import live_switch  # noqa: E402
from photon_bake.tests.bench.window_steps import play  # noqa: E402

ARGUMENTS = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
MINUTES, SEED = float(ARGUMENTS[0]) if ARGUMENTS else 60.0, int(ARGUMENTS[1]) if len(ARGUMENTS) > 1 else 0
OFF = "off" in ARGUMENTS
TICK, MOST_OBJECTS, MOST_VERTICES = 0.05, 12, 1000
SAME_PLACE = 1e-3
"""Meters between vertices, and a tenth of the sine between their normals, that are one and the same."""
MOST_APART, MOST_GROWN = 0.05, 0.05
"""Of means of light, as a share of it; and of memory after two fifths of the time."""
N_SAMPLE = 1000
LOADED = ctypes.CDLL(None)
"""All that is loaded, of which the allocators are: oneTBB's and the system's."""

chance = random.Random(SEED)
folder = tempfile.TemporaryDirectory()


def scene():
    return bpy.context.window_manager.windows[0].scene


def objects(kind):
    return [obj for obj in scene().objects if obj.type == kind]


def call(operator, *arguments, **options):
    """Call an operator as in the 3D view."""
    window = bpy.context.window_manager.windows[0]
    area = next(one for one in window.screen.areas if one.type == "VIEW_3D")
    region = next(one for one in area.regions if one.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        if operator.poll():
            operator(*arguments, **options)


def push(message):
    call(bpy.ops.ed.undo_push, message=message)


def spot():
    return [chance.uniform(-3, 3), chance.uniform(-3, 3), chance.uniform(0.5, 3)]


def move_lamp():
    chance.choice(objects("LIGHT")).location = spot()


def change_lamp():
    light = chance.choice(objects("LIGHT")).data
    light.energy, light.color = chance.uniform(100, 1000), [chance.random() for _ in range(3)]


def move_object():
    obj = chance.choice(objects("MESH"))
    obj.location, obj.rotation_euler.z = spot(), chance.uniform(0, 6)


def color():
    material = chance.choice(objects("MESH")).active_material
    if material:
        node = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
        node.inputs["Base Color"].default_value = (*(chance.random() for _ in range(3)), 1)


def world():
    nodes = scene().world.node_tree.nodes if scene().world else []
    for node in nodes:
        if node.type == "BACKGROUND":
            node.inputs["Color"].default_value = (*(chance.random() for _ in range(3)), 1)


def add():
    if len(scene().objects) < MOST_OBJECTS:
        kind = chance.choice([bpy.ops.mesh.primitive_cube_add, bpy.ops.mesh.primitive_uv_sphere_add])
        call(kind, location=spot())
        if chance.random() < 0.3:
            call(bpy.ops.object.light_add, type=chance.choice(["POINT", "AREA", "SUN"]), location=spot())


def delete():
    for kind, least in (("MESH", 2), ("LIGHT", 1)):
        there = objects(kind)
        if len(there) > least and chance.random() < 0.5:
            bpy.data.objects.remove(chance.choice(there))


def rename():
    obj = chance.choice(list(scene().objects))
    obj.name = f"Name {chance.randrange(1000)}"


def hide():
    obj = chance.choice(objects("MESH"))
    obj.hide_set(not obj.hide_get())


def edit_mesh():
    obj = chance.choice(objects("MESH"))
    call(bpy.ops.object.select_all, action="DESELECT")
    if obj.hide_get():
        return
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    call(bpy.ops.object.mode_set, mode="EDIT")
    call(bpy.ops.mesh.select_all, action="SELECT")
    call(bpy.ops.transform.resize, value=(1.05, 0.95, 1.0))
    for _ in range(chance.choice([1, 1, 5])):
        yield
    if chance.random() < 0.3 and len(obj.data.vertices) < MOST_VERTICES:
        call(bpy.ops.mesh.subdivide)  # other faces than before
        yield
    call(bpy.ops.object.mode_set, mode="OBJECT")


def undo():
    call(bpy.ops.ed.undo)


def redo():
    call(bpy.ops.ed.redo)


def frame():
    scene().frame_set(chance.randrange(1, 50))


def animate():
    obj = chance.choice(objects("MESH"))
    obj.keyframe_insert("location", frame=chance.randrange(1, 50))


def load():
    bpy.ops.wm.open_mainfile(filepath=str(Path(folder.name) / "start.blend"))


def switch():
    if OFF:
        return
    call(bpy.ops.photon_bake.live)
    yield
    if not live_switch.on:
        call(bpy.ops.photon_bake.live)


EDITS = [move_lamp] * 8 + [move_object] * 8 + [change_lamp] * 4 + [color] * 4 + [undo] * 4 + [redo] * 2 + [frame] * 3
EDITS += [world, add, add, delete, rename, hide, edit_mesh, animate]
EDITS = EDITS * 4 + [load, switch] * 2
NO_STEP = (undo, redo, frame, load, switch)
"""Edits that are no steps of undo."""


def steps():
    """The steps; each yield lets Blender run on."""
    sys.excepthook = sys.unraisablehook = threading.excepthook = note
    compiler._tried = True  # the thread compiles what it needs
    photon_bake.register()
    yield
    call(bpy.ops.mesh.primitive_plane_add, size=10, location=(0, 0, 0))
    settings = scene().photon_bake.live
    settings.n_vertices, settings.n_links = 10_000, 64  # so many that all vertices find light
    bpy.ops.wm.save_as_mainfile(filepath=str(Path(folder.name) / "start.blend"))
    push("Start")
    yield from turned_on()
    begun, counts, late, tenths = perf_counter(), Counter(), [], []
    while perf_counter() < begun + 60 * MINUTES:
        edit = chance.choice(EDITS)
        counts[edit.__name__] += 1
        waiting = edit()
        if waiting is not None:
            yield from waiting
        if edit not in NO_STEP:
            push(edit.__name__)
        for _ in range(chance.choice([1, 1, 2, 5, 20])):
            due = perf_counter() + TICK
            yield
            late.append(perf_counter() - due)
        if not OFF and not live_switch.on:
            assert "gives light" in live_switch.error, live_switch.error
            load()
            yield from turned_on()
        if len(tenths) < 9 and perf_counter() > begun + 6 * MINUTES * (len(tenths) + 1):
            yield from converged_anew()
            tenths.append(memory())
            print(f"{10 * len(tenths)} %: {sum(counts.values())} edits, {tenths[-1]:.0f} MB", flush=True)
    grown = tenths[-1] / tenths[3] - 1 if len(tenths) > 3 else 0.0
    print(dict(counts), f"late: {np.median(late):.3f} s, at most {max(late):.2f} s", flush=True)
    if not OFF:
        yield from compare()
    print(f"{grown:+.1%} of memory from 40 to 90 %; {len(raised)} exceptions", flush=True)
    assert not raised and grown < MOST_GROWN


def turned_on():
    """Live light on, unless it is to stay off."""
    if not OFF:
        call(bpy.ops.photon_bake.live)
        yield from until(lambda: live_switch.session and live_switch.session.light, 3600)


raised = []


def note(*unhandled):
    """Count an exception that nobody handles."""
    raised.append(unhandled)
    traceback.print_exception(getattr(unhandled[0], "exc_value", None) or unhandled[1])


def converged_anew():
    """Open the first file and let its light converge."""
    load()
    yield
    if not OFF:
        yield from until(lambda: live_switch.session and live_switch.session.light, 60)
        yield from until(lambda: live_switch.session.light.converged, 300)


def compare():
    """How far the light is from that of a fresh start, and both from that of a bake."""
    if bpy.context.mode != "OBJECT":  # an undo may have led there; what is edited holds still
        call(bpy.ops.object.mode_set, mode="OBJECT")
    lights = []
    for _ in range(2):
        yield from until(lambda: live_switch.session and live_switch.session.light, 60)
        session = live_switch.session
        yield from until(lambda session=session: session.behind is None and session.light.converged, 300)
        scenery = session.scenery()
        lights.append((*places(scenery, scenery.shown_in(space())), session.light))
        call(bpy.ops.photon_bake.live)
        yield
        call(bpy.ops.photon_bake.live)
    (at, shown, light), (others_at, _, other) = lights
    distance, nearest = cKDTree(others_at).query(at)
    same = np.flatnonzero(shown & (distance < SAME_PLACE))
    errors = ", ".join(f"{one.error:.1%}" for *_, one in lights)
    found = len(same) / shown.sum()
    print(f"of {shown.sum()} vertices {found:.1%} are where a fresh start, of {len(others_at)}, has some", flush=True)
    for name in ("direct", "indirect"):
        one, two = getattr(light, name)[same].astype(float), getattr(other, name)[nearest[same]].astype(float)
        apart, ratio = np.sqrt(((one - two) ** 2).mean()) / two.mean(), one.mean() / two.mean()
        print(f"{name}: {apart:.1%} from that of a fresh start, {ratio:.4f} of it; errors {errors}", flush=True)
        assert abs(ratio - 1) < MOST_APART, "the light is another one"
    sample = np.random.default_rng(1).choice(same, min(N_SAMPLE, len(same)), replace=False)
    baked = light_of_bake(session, nearest[sample])
    for name, truth in baked.items():
        ways = getattr(light, name)[sample], getattr(other, name)[nearest[sample]]
        off = (f"{np.sqrt(((one - truth) ** 2).mean()) / truth.mean():.1%}" for one in ways)
        means = (f"{one.mean() / truth.mean():.4f}" for one in ways)
        print(f"{name}, edited and fresh: {', '.join(off)} from a bake, {', '.join(means)} of it", flush=True)


def light_of_bake(session, rows):
    """Direct and indirect E/π of a bake at some vertices of a fresh session."""
    scene_read = session._reading.scene
    receivers = session.light.surfaces.receivers().where(rows)
    settings = settings_for("high", interpolate=False, add_direct=True)
    passes = bake(scene_read, receivers, settings, EmbreeTracer(scene_read)).passes
    return {name: passes[name] / np.pi for name in ("direct", "indirect")}


def space():
    """A 3D view."""
    screen = bpy.context.window_manager.windows[0].screen
    return next(area for area in screen.areas if area.type == "VIEW_3D").spaces.active


def places(scenery, shown):
    """Where vertices are, and how they face, (n, 6), and whether they are shown; their order depends on places."""
    rows, seen = [], []
    for mesh in scenery.light.surfaces.meshes:
        to_world = scenery.transforms[mesh.object].astype(float)
        normal = mesh.normal @ np.linalg.inv(to_world[:3, :3])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        rows.append(np.concatenate([mesh.position @ to_world[:3, :3].T + to_world[:3, 3], normal / 10], axis=1))
        seen.append(np.full(len(normal), shown[mesh.object]))
    return np.concatenate(rows), np.concatenate(seen)


def until(done, limit):
    """Let Blender run until `done`."""
    end = perf_counter() + limit
    while not done():
        if perf_counter() > end:
            raise TimeoutError(live_switch.words)
        yield


def memory():
    """What the process has in memory, MB, without what its allocators keep for later."""
    gc.collect()
    for command, arguments in (("scalable_allocation_command", (0, None)), ("malloc_trim", (0,))):
        if hasattr(LOADED, command):
            getattr(LOADED, command)(*arguments)
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def end(status):
    """Leave nothing behind."""
    folder.cleanup()
    return status


play(steps(), TICK, end)
