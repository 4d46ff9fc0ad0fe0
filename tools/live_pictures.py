"""Pictures of live light before and after a lamp is moved, beside Cycles' viewport; and one of a lamp that is dragged.

    tools/screenshot_panel.sh BLENDER build/live tools/live_pictures.py     the pictures, in a Blender with a window
    python tools/live_pictures.py build/live                               joins them: live.jpg and live.gif

The room is the demo scene's without its sun. Pictures of the screen are asked for as in screenshot_panel.py; meanwhile
nothing else runs on Blender's main thread, so that they show what was drawn last at the time in their name. Prints how
long after the lamp's move the first new light was drawn, and how far the light had converged at each picture. Joining
needs ImageMagick.
"""

import importlib.util
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter, sleep
from types import ModuleType
from typing import Any

TOOLS = Path(__file__).resolve().parent

TIMES = (0.1, 1.0, 10.0)
"""Seconds after the lamp's move at which pictures are taken."""

PATH = ((0.9, 3.9, 2.3), (3.3, 2.2, 1.5))
"""Where the lamp is before and after."""

N_FRAMES, FRAME = 32, 0.2
"""Pictures of the animation, and seconds between them."""


def show(folder: Path) -> Iterator[None]:
    """The steps of the performance."""
    import bpy

    area = yield from open_room(folder)
    lamp = bpy.data.objects["Lamp"]
    switch = live_switch()
    bpy.ops.photon_bake.live()
    yield from pictures.until(lambda: not switch.on or switch.session.light, 600)  # kernels may have to be compiled
    begun = perf_counter()
    yield from pictures.until(lambda: not switch.on or settled(switch, begun), 60)
    if not switch.on:
        raise RuntimeError(switch.error)
    print(f"live_pictures: before the move: {switch.words}")
    take(folder, "live_before")
    yield from moved(folder, lamp, "live", switch)
    yield from dragged(folder, lamp)
    bpy.ops.photon_bake.live()
    lamp.location = PATH[0]
    bpy.context.scene.render.engine = "CYCLES"
    bpy.context.scene.cycles.use_preview_denoising = True
    area.spaces.active.shading.type = "RENDERED"
    yield from pictures.wait(20.0)
    take(folder, "cycles_before")
    yield from moved(folder, lamp, "cycles", None)


def open_room(folder: Path) -> Any:
    """The demo scene's room with a lamp of its own; returns the 3D view."""
    import bpy

    pictures.open_demo_scene(folder / "demo.blend")
    yield from pictures.wait(1.0)
    area = pictures.set_up_view()
    space = area.spaces.active
    space.show_region_ui, space.overlay.show_overlays = False, True
    space.overlay.show_floor = space.overlay.show_axis_x = space.overlay.show_axis_y = space.overlay.show_cursor = False
    bpy.data.objects.remove(bpy.data.objects["Sun"])
    light = bpy.data.lights.new("Lamp", "POINT")
    light.energy, light.shadow_soft_size, light.color = 35.0, 0.08, (1.0, 0.85, 0.65)
    lamp = bpy.data.objects.new("Lamp", light)
    lamp.location = PATH[0]
    scene = bpy.context.scene
    scene.collection.objects.link(lamp)
    lamp.select_set(True)
    bpy.context.view_layer.objects.active = lamp
    background = next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Strength"].default_value = 0.1
    yield from pictures.wait(1.0)
    region = next(region for region in area.regions if region.type == "WINDOW")
    height = bpy.context.window_manager.windows[0].height
    crop = f"{region.width}x{region.height}+{region.x}+{height - region.y - region.height}"
    (folder / "crop.txt").write_text(crop)
    print(f"live_pictures: the view is at {crop}")
    return area


def moved(folder: Path, lamp: Any, name: str, switch: Any) -> Iterator[None]:
    """Move the lamp, and take pictures afterwards."""
    begun, first = perf_counter(), None
    lamp.location = PATH[1]
    for seconds in TIMES:
        while True:
            yield
            if switch and first is None and switch.session.light.since > begun:
                first = perf_counter() - begun
            if perf_counter() > begun + seconds:
                break
        if switch:
            print(f"live_pictures: {perf_counter() - begun:.2f} s after the move: {switch.words}")
        take(folder, f"{name}_{seconds:g}s")
    if first is not None:
        print(f"live_pictures: new light {first:.3f} s after the move")


def dragged(folder: Path, lamp: Any) -> Iterator[None]:
    """Move the lamp there and back in real time, with a picture now and then."""
    begun = perf_counter()
    for frame in range(N_FRAMES):
        end = begun + (frame + 1) * FRAME
        while perf_counter() < end:
            share = (perf_counter() - begun) / (N_FRAMES * FRAME)
            there = 1 - abs(2 * share - 1)
            smooth = there * there * (3 - 2 * there)
            lamp.location = [a + smooth * (b - a) for a, b in zip(PATH[1], PATH[0], strict=True)]
            yield
        paused = perf_counter()
        take(folder, f"frame_{frame:03d}")
        begun += perf_counter() - paused


def settled(switch: Any, begun: float) -> bool:
    """Whether the light stays as it is, or was given half a minute."""
    return bool(switch.session.light.converged) or perf_counter() > begun + 30


def take(folder: Path, name: str) -> None:
    """Have a picture of the screen taken, and let nothing happen meanwhile."""
    ready = folder / f"{name}.ready"
    ready.touch()
    while ready.exists():
        sleep(0.01)


def live_switch() -> Any:
    """The extension's own switch, whatever repository it is installed in."""
    name = next(name for name in sys.modules if name.endswith("photon_bake.addon.ui.live"))
    return sys.modules[name].live_switch


def join(folder: Path) -> None:
    """live.jpg: a row of pictures a renderer; live.gif: the lamp that is dragged."""
    crop = (folder / "crop.txt").read_text() if (folder / "crop.txt").is_file() else "1000x800+0+40"
    cut = ["-crop", crop, "+repage", "-resize", "480x"]
    rows = []
    for name in ("live", "cycles"):
        row = [str(folder / f"{name}_{when}.png") for when in ("before", *(f"{seconds:g}s" for seconds in TIMES))]
        rows += ["(", *row, *cut, "+append", ")"]
    subprocess.run(["convert", *rows, "-append", "-quality", "85", str(folder / "live.jpg")], check=True)
    frames = sorted(str(path) for path in folder.glob("frame_*.png"))
    delay = ["-delay", str(round(100 * FRAME)), "-loop", "0"]
    small = ["-fuzz", "2%", "-layers", "OptimizeTransparency", "-colors", "128"]
    subprocess.run(["convert", *delay, *frames, *cut, *small, str(folder / "live.gif")], check=True)


def _load(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


if __name__ == "__main__":
    if "--" in sys.argv:
        pictures = _load(TOOLS / "screenshot_panel.py")
        pictures.main(show)
    else:
        join(Path(sys.argv[1]))
