"""How long after an edit a window shows new light, in scenes of `live.py`.

    blender --factory-startup --window-geometry 0 0 1280 900 --python tests/bench/window_first_light.py -- [SCENE...]

SCENE is fifty, cornell or classroom, in the folder of scenes; cornell and fifty unless told. The scene is shown whole
in Solid shading, at 20,000 vertices as in `live.py`. Edits are made to Blender's data as a script's or a driver's are,
each as soon as the one before is seen. The time ends when a 3D view is drawn with light that knows of the edit: after
the view's last handler, once a pixel was read back. Prints a table, and how many pixels an edit changed at least. Needs
what `window_live.py` needs.
"""

import sys
from pathlib import Path
from time import perf_counter

import bpy
import gpu
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / ".venv" / "src"), str(ROOT), str(ROOT / "tests" / "bench")]

import photon_bake  # noqa: E402
from figures import table  # noqa: E402
from live import EDITED, N_EDITS, N_VERTICES, fifty  # noqa: E402
from photon_bake.addon.pipeline.warm_up import compiler  # noqa: E402
from photon_bake.addon.ui.live import live_switch  # noqa: E402
from window_steps import play  # noqa: E402

SCENES = ROOT.parent / "shared" / "scenes"
NAMES = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
HEAD = ["Scene", "Vertices", "View", "Edit", "Median", "95 %", "Pixels that change"]
TICK = 0.02


class Watch:
    """Says when a view was first drawn with light that knows of an edit."""

    def __init__(self):
        self.since, self.seen_at, self.pixels = np.inf, None, None

    def look(self):
        session = live_switch.session
        if self.seen_at is not None or session is None or session.light is None:
            return
        if session.light.since >= self.since:
            frame = gpu.state.active_framebuffer_get()
            frame.read_color(0, 0, 1, 1, 4, 0, "FLOAT")
            self.seen_at = perf_counter()
            self.pixels = picture(frame)

    def wait(self, edit):
        """Make an edit, and let Blender run until it is seen."""
        self.since, self.seen_at = perf_counter(), None
        edit()
        while self.seen_at is None:
            assert live_switch.on, live_switch.error
            yield


def picture(frame):
    """Colors of a framebuffer, (h, w, 4)."""
    _, _, width, height = gpu.state.viewport_get()
    return np.array(memoryview(frame.read_color(0, 0, width, height, 4, 0, "FLOAT")))


def steps():
    """The steps; each yield lets Blender run on."""
    compiler._tried = True  # the thread compiles what it needs
    photon_bake.register()
    watch = Watch()
    bpy.types.SpaceView3D.draw_handler_add(watch.look, (), "WINDOW", "POST_PIXEL")
    rows = []
    for name in NAMES or ["cornell", "fifty"]:
        yield from opened(name)
        scene = bpy.context.window_manager.windows[0].scene
        scene.photon_bake.live.n_vertices = N_VERTICES
        yield from watch.wait(lambda: call(bpy.ops.photon_bake.live))
        yield from converged()
        session, size = live_switch.session, watch.pixels.shape
        for kind, edit in edits_of(scene, name).items():
            times, changed = [], []
            for k in range(N_EDITS):
                before = watch.pixels
                yield from watch.wait(lambda edit=edit, k=k: edit((k + 1) / N_EDITS))
                times.append(watch.seen_at - watch.since)
                changed.append((np.abs(watch.pixels - before) > 1 / 512).any(axis=2).mean())
            edit(0.0)
            yield from converged()
            late = (f"{1000 * value:.0f} ms" for value in np.quantile(times, (0.5, 0.95)))
            view = f"{size[1]} × {size[0]}"
            rows.append([name, f"{len(session.light.surfaces):,}", view, kind, *late, f"≥ {min(changed):.0%}"])
        call(bpy.ops.photon_bake.live)
    table("Live light after edits in a window", HEAD, rows)


def opened(name):
    """Open a scene, and show all of it."""
    if name == "fifty":
        fifty()
    else:
        bpy.ops.wm.open_mainfile(filepath=str(SCENES / name / f"{name}.blend"), load_ui=False)
    yield
    space = view_3d()[0].spaces.active
    space.shading.type, space.shading.show_backface_culling = "SOLID", True
    space.region_3d.view_perspective = "PERSP"
    call(bpy.ops.view3d.view_all)
    for _ in range(50):  # it turns smoothly
        yield


def converged():
    """Until light stays as it is."""
    while True:
        yield
        session = live_switch.session
        if session.behind is None and not session.changes and session.light.converged:
            return


def edits_of(scene, name):
    """For each kind, what makes the edit at a time from 0 to 1."""
    of_lamp, of_object, of_material = EDITED[name]
    lamp, obj, material = scene.objects[of_lamp], scene.objects[of_object], bpy.data.materials[of_material]
    lamp_at, turned, at, size = lamp.location.copy(), lamp.rotation_euler.copy(), obj.location.copy(), obj.dimensions
    node = next(node for node in material.node_tree.nodes if node.type in {"BSDF_PRINCIPLED", "BSDF_DIFFUSE"})
    socket, step = node.inputs[0], 0.7 * (size.x + size.y) / 2
    paint = tuple(socket.default_value)

    def lamp_moved(t):
        if lamp.data.type == "SUN":
            lamp.rotation_euler.x = turned.x + 0.5 * t
        else:
            lamp.location = lamp_at.x + 0.4 * t, lamp_at.y + 0.4 * t, lamp_at.z

    def object_moved(t):
        obj.location = at.x + t * step, at.y + t * step, at.z + 0.02 * size.z

    def color_changed(t):
        factors = (1 - 0.6 * t, 1 - 0.2 * t, 1 - 0.8 * t, 1)
        socket.default_value = [a * b for a, b in zip(paint, factors, strict=True)]

    return {"lamp moved": lamp_moved, "object moved": object_moved, "color of a material changed": color_changed}


def view_3d():
    """The 3D view's area, and its region."""
    area = next(one for one in bpy.context.window_manager.windows[0].screen.areas if one.type == "VIEW_3D")
    return area, next(region for region in area.regions if region.type == "WINDOW")


def call(operator, **options):
    """Call an operator as in the 3D view."""
    area, region = view_3d()
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=area, region=region):
        operator(**options)


play(steps(), TICK, lambda status: status)
