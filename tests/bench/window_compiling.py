"""How late a timer of a Blender with a window is while kernels are compiled, and while a first bake waits and runs.

    blender --factory-startup --window-geometry 0 0 400 300 --python tests/bench/window_compiling.py [-- SECONDS]

Begins with an empty folder of kernels. Prints a row for each: nothing going on, the process that compiles, a bake that
comes first, a bake afterwards. With SECONDS it looks at the process, and at a bake that waits for it, for so long each,
and ends. The window is small, as drawing one without a GPU takes 0.1 s of the main thread. Needs
the extension's libraries in Blender's Python, as `python tools/install_zip.py --tests BLENDER` lays them out, and a
display (Xvfb does).
"""

import os
import sys
import tempfile
from pathlib import Path
from time import perf_counter

import bpy
import numpy as np

TICK, ALONE = 0.02, 5.0  # s
LIMIT = float(sys.argv[sys.argv.index("--") + 1]) if "--" in sys.argv else np.inf  # s
ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / ".venv" / "src"), str(ROOT)]

folder = tempfile.TemporaryDirectory()
os.environ["PHOTON_BAKE_KERNELS"] = folder.name

import photon_bake  # noqa: E402
from photon_bake.addon.pipeline.warm_up import compiler  # noqa: E402
from photon_bake.addon.ui.state import bake_state  # noqa: E402
from photon_bake.tests.bench.window_steps import play  # noqa: E402


class Ticks:
    """How late a timer was since it was asked last."""

    def __init__(self):
        self.late, self._due = [], perf_counter() + TICK
        bpy.app.timers.register(self._tick, first_interval=TICK, persistent=True)

    def _tick(self):
        self.late.append(perf_counter() - self._due)
        self._due = perf_counter() + TICK
        return TICK

    def row(self, name, seconds):
        late, self.late = 1000 * np.array(self.late), []
        values = f"{np.median(late):.1f} | {np.quantile(late, 0.99):.1f} | {late.max():.1f}"
        print(f"| {name} | {seconds:.1f} | {len(late)} | {values} | {np.count_nonzero(late > 100)} |", flush=True)


def steps():
    """The steps; each yield lets Blender run on."""
    ticks = Ticks()
    yield
    ticks.late.clear()
    print("| Meanwhile | Seconds | Ticks | Median, ms | 99%, ms | Most, ms | Over 100 ms |")
    print("|---|---|---|---|---|---|---|")
    end = perf_counter() + ALONE
    while perf_counter() < end:
        yield
    ticks.row("nothing", ALONE)
    if np.isfinite(LIMIT):
        yield from in_part(ticks)
        return
    for name in ("enabled, compiling", "a bake that comes first, and waits"):
        begun = perf_counter()
        photon_bake.register()
        print(f"Enabling took {perf_counter() - begun:.3f} s", flush=True)
        ticks.late.clear()
        begun = perf_counter()
        if name.startswith("enabled"):
            while compiler.running:
                yield
            ticks.row(name, perf_counter() - begun)
            yield from bake(ticks, "the first bake after it")
            photon_bake.unregister()
            for path in Path(folder.name).glob("*/*.txt"):
                path.unlink()
        else:
            yield from bake(ticks, name)
    yield from bake(ticks, "a bake afterwards")
    photon_bake.unregister()


def in_part(ticks):
    """Rows of the process that compiles, and of a bake that waits for it, each looked at for `LIMIT`."""
    photon_bake.register()
    ticks.late.clear()
    end = perf_counter() + LIMIT
    while compiler.running and perf_counter() < end:
        yield
    ticks.row("enabled, compiling", LIMIT)
    yield from bake(ticks, "a bake that comes first, and waits")


def bake(ticks, name):
    """Bake the start-up file by the button's way."""
    properties = bpy.context.window_manager.windows[0].scene.photon_bake
    properties.quality, properties.targets = "draft", {"vertex"}
    window = bpy.context.window_manager.windows[0]
    area = next(one for one in window.screen.areas if one.type == "VIEW_3D")
    region = next(one for one in area.regions if one.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        if not bpy.data.objects.get("Plane"):
            bpy.ops.mesh.primitive_grid_add(size=8.0, x_subdivisions=100, y_subdivisions=100)
        ticks.late.clear()
        begun, stages = perf_counter(), []
        bpy.ops.photon_bake.bake_indirect("INVOKE_DEFAULT")
    while bake_state.running and perf_counter() < begun + LIMIT:
        stages += [bake_state.stage] if bake_state.stage not in stages else []
        yield
    ticks.row(name, perf_counter() - begun)
    print(bake_state.result, bake_state.error, stages, flush=True)


def end(status):
    """Leave nothing behind."""
    folder.cleanup()
    return status


play(steps(), 0.1, end)
