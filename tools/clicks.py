"""Count the clicks from the tab to a better render, in a Blender with a window: `screenshot_panel.sh` runs it.

    blender --enable-event-simulate --python tools/clicks.py -- FOLDER        where the extension is enabled

Plays someone who opens the demo scene with the sidebar on the Photon Bake tab, for each target from the settings that
Blender starts with. It moves the pointer over the tab until Blender says that the button that it looks for is under
it, and presses there; it calls no operator of the extension. Each click has a picture, asked for by the empty file
FOLDER/NAME.ready, which whoever takes it deletes; renders before and after are FOLDER/NAME.png. Prints a table of
clicks and of how much of the light of a render with all bounces is there before and after, and quits.
"""

import importlib.util
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import bpy

TOOLS = Path(__file__).resolve().parent
STEP = 8
"""Pixels between two places where a button is looked for."""

EEVEE = "BLENDER_EEVEE" if bpy.app.version >= (5, 0, 0) else "BLENDER_EEVEE_NEXT"

ALLOWED = {"vertices": 2, "lightmaps": 3, "camera": 3}
"""Clicks that a target may take."""

Found = tuple[str, str]
"""What is under the pointer: the Python command of a button, the path of a property."""


class Hand:
    """A pointer over a sidebar, and what it clicks."""

    def __init__(self, folder: Path, name: str) -> None:
        self._folder, self._name = folder, name
        self.n_clicks = 0

    def click(self, wanted: Callable[[Found], bool], nth: int = 0) -> Iterator[None]:
        """Press the button that `wanted` knows, the nth of several, and have a picture taken before."""
        x, y = yield from self._find(wanted, nth)
        self.n_clicks += 1
        yield from screenshot(self._folder / f"clicks_{self._name}_{self.n_clicks}.ready")
        window = bpy.context.window_manager.windows[0]
        for value in ("PRESS", "RELEASE"):
            window.event_simulate(type="LEFTMOUSE", value=value, x=x, y=y)
            yield
        yield from pictures.wait(0.5)

    def _find(self, wanted: Callable[[Found], bool], nth: int) -> Any:
        """Where the nth button is: its middle."""
        window = bpy.context.window_manager.windows[0]
        area = view(window)
        sidebar = next(region for region in area.regions if region.type == "UI")
        columns = [int(sidebar.x + share * sidebar.width) for share in (0.22, 0.66)]
        seen: list[list[tuple[int, int]]] = []
        last: dict[int, tuple[int, Found]] = {}
        for y in range(sidebar.y + sidebar.height - STEP, sidebar.y, -STEP):
            for x in columns:
                window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
                yield
                yield
                found = under_pointer(window, area, sidebar)
                if not wanted(found):
                    continue
                if x in last and last[x][0] == y + STEP and len(seen[-1]) < 3:
                    next(one for one in reversed(seen) if one[-1][0] == x).append((x, y))
                else:
                    seen.append([(x, y)])
                last[x] = (y, found)
            if len(seen) > nth and y < seen[nth][-1][1] - STEP:
                break
        if len(seen) <= nth:
            raise LookupError("there is no such button in the tab")
        x, y = seen[nth][len(seen[nth]) // 2]
        window.event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
        yield
        return x, y


def under_pointer(window: Any, area: Any, region: Any) -> Found:
    """What Blender says is under the pointer."""
    with bpy.context.temp_override(window=window, area=area, region=region):
        path = bpy.context.property[1] if bpy.context.property else ""
        if not bpy.ops.ui.copy_python_command_button.poll():
            return "", path
        clipboard = bpy.context.window_manager.clipboard
        bpy.ops.ui.copy_python_command_button()
        command, bpy.context.window_manager.clipboard = bpy.context.window_manager.clipboard, clipboard
        return command, path


def operator(name: str) -> Callable[[Found], bool]:
    """The button of an operator."""
    return lambda found: found[0].startswith(f"bpy.ops.{name}(")


def is_target(found: Found) -> bool:
    """The buttons that choose what is baked to, in rows of two."""
    return found[1] == "photon_bake.targets"


def play(folder: Path) -> Iterator[None]:
    """The performance."""
    pictures.open_demo_scene(folder / "demo.blend")
    yield from pictures.wait(1.0)
    truth = _render(folder / "clicks_all_bounces.png", "CYCLES")
    rows = []
    for name, target in (("vertices", None), ("lightmaps", 1), ("camera", 2)):
        bpy.ops.wm.open_mainfile(filepath=str(folder / "demo.blend"))
        yield from pictures.wait(1.0)
        area = pictures.set_up_view()
        yield from pictures.wait(1.0)
        pictures.open_tab(area)
        yield from pictures.wait(1.0)
        bpy.context.scene.render.engine = EEVEE
        bpy.context.scene.photon_bake.quality = "draft"  # for the sake of whoever waits
        before = _render(folder / f"clicks_{name}_before.png")
        hand, state = Hand(folder, name), pictures.bake_state()
        if target is not None:
            yield from hand.click(is_target, target)
        yield from hand.click(operator("photon_bake.bake_indirect"))
        yield from pictures.until(lambda state=state: state.result or state.error, 900)
        if state.error:
            raise RuntimeError(state.error)
        yield from pictures.wait(1.0)
        last = "photon_bake.add_pass" if name == "camera" else "photon_bake.use_baked_light"
        yield from hand.click(operator(last))
        yield from screenshot(folder / f"clicks_{name}_done.ready")
        after = _render(folder / f"clicks_{name}_after.png")
        rows.append((name, hand.n_clicks, before / truth, after / truth))
    print("clicks: | Baked to | Clicks | Light before | after |")
    for name, n_clicks, before, after in rows:
        print(f"clicks: | {name} | {n_clicks} of {ALLOWED[name]} allowed | {before:.0%} | {after:.0%} |")
    if any(n > ALLOWED[name] or after <= before for name, n, before, after in rows):
        raise RuntimeError("more clicks than allowed, or no better render")


def _render(path: Path, engine: str = EEVEE) -> float:
    """Render the scene, and return the mean of its pixels as stored."""
    render = bpy.context.scene.render
    kept = render.engine, render.resolution_percentage, render.filepath
    render.engine, render.resolution_percentage, render.filepath = engine, 30, str(path)
    if engine == "CYCLES":
        cycles = bpy.context.scene.cycles
        cycles.samples, cycles.device, cycles.max_bounces, cycles.diffuse_bounces = 24, "CPU", 32, 32
    bpy.ops.render.render(write_still=True)
    render.engine, render.resolution_percentage, render.filepath = kept
    return _brightness(path)


def _brightness(path: Path) -> float:
    """The mean of a picture's pixels, as stored."""
    import numpy as np

    image = bpy.data.images.load(str(path))
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return float(pixels.reshape(-1, 4)[:, :3].mean())


def view(window: Any) -> Any:
    """The 3D view."""
    return next(area for area in window.screen.areas if area.type == "VIEW_3D")


def screenshot(ready: Path) -> Iterator[None]:
    """Ask for a picture of the screen."""
    for area in bpy.context.window_manager.windows[0].screen.areas:
        area.tag_redraw()
    yield from pictures.wait(0.5)
    yield from pictures.picture(ready)


def _load(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


pictures = _load(TOOLS / "screenshot_panel.py")

if __name__ == "__main__":
    pictures.main(play)
