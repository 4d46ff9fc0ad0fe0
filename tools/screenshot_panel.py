"""Show the panel before a camera: run by a Blender with a window, for `screenshot_panel.sh`.

    blender --python tools/screenshot_panel.py -- FOLDER        where the extension is enabled

Opens the demo scene with the sidebar on the Photon Bake tab, bakes it by the button's way, and asks for pictures of
the screen by making the empty file FOLDER/NAME.ready: panel_baking while the bake runs, panel_baked when its light is
shown, panel_lightmaps after a bake to these, debug_views after a draft that these look into. Whoever takes the picture
deletes the file. Prints how late Blender's own timers came meanwhile, which is how long the window was deaf, and quits.
"""

import importlib.util
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from time import perf_counter
from types import ModuleType
from typing import Any

import bpy

TICK = 0.05
TOOLS = Path(__file__).resolve().parent


def show(folder: Path) -> Iterator[None]:
    """The steps of the performance; each ``yield`` lets Blender run on for a tick."""
    open_demo_scene(folder / "demo.blend")
    yield from wait(1.0)
    area = set_up_view()
    yield from wait(1.0)
    open_tab(area)
    yield from wait(1.0)
    state = bake_state()
    bpy.context.scene.photon_bake.quality = "high"
    _press_bake(area)
    yield from until(lambda: state.fraction > 0.5 or not state.running, 600)
    yield from picture(folder / "panel_baking.ready")
    lateness = yield from until(lambda: not state.running, 600)
    print(f"screenshot_panel: {state.result or state.error} Timers came at most {lateness * 1000:.0f} ms late.")
    area.spaces.active.shading.color_type = "VERTEX"
    yield from wait(2.0)
    yield from picture(folder / "panel_baked.ready")
    yield from _lightmaps(area, folder)
    yield from _debug_views(area, folder / "debug_views.ready")


def open_demo_scene(path: Path) -> None:
    """The demo scene, saved as `path`."""
    _load(TOOLS / "demo_scene.py").build(str(path))


def set_up_view() -> Any:
    """The 3D view through the camera, flat-lit, with its sidebar."""
    area = next(area for area in bpy.context.window_manager.windows[0].screen.areas if area.type == "VIEW_3D")
    space = area.spaces.active
    space.show_region_ui = True
    space.region_3d.view_perspective = "CAMERA"
    space.region_3d.view_camera_zoom = 20
    space.overlay.show_overlays = False
    space.shading.type, space.shading.light, space.shading.color_type = "SOLID", "FLAT", "MATERIAL"
    return area


def open_tab(area: Any) -> None:
    """The sidebar on our tab; it has its tabs only once it was drawn."""
    next(region for region in area.regions if region.type == "UI").active_panel_category = "Photon Bake"


def _press_bake(area: Any) -> None:
    region = next(region for region in area.regions if region.type == "WINDOW")
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.photon_bake.bake_indirect("INVOKE_DEFAULT")


def _lightmaps(area: Any, folder: Path) -> Iterator[None]:
    """Lightmaps of all objects, and their image where the Properties editor was."""
    properties, state = bpy.context.scene.photon_bake, bake_state()
    properties.targets, properties.quality = {"lightmap"}, "medium"
    properties.lightmap.atlas = "shared"
    _press_bake(area)
    yield from until(lambda: not state.running, 600)
    window = bpy.context.window_manager.windows[0]
    editor = next(one for one in window.screen.areas if one.type == "PROPERTIES")
    editor.type = "IMAGE_EDITOR"
    editor.spaces.active.image = bpy.data.images["Photon Bake Atlas"]
    yield from wait(2.0)
    region = next(region for region in editor.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=editor, region=region):
        bpy.ops.image.view_all(fit_view=True)
    yield from wait(2.0)
    yield from picture(folder / "panel_lightmaps.ready")
    properties.targets, editor.type = {"vertex"}, "PROPERTIES"


def _debug_views(area: Any, ready: Path) -> Iterator[None]:
    """A draft's photons and cells over dark surfaces."""
    panel = bpy.types.PHOTON_BAKE_PT_debug_views
    opened = type("PHOTON_BAKE_PT_opened", (panel,), {"bl_options": set()})  # the panel itself remembers to be closed
    bpy.utils.unregister_class(panel)
    bpy.utils.register_class(opened)
    views, state, shading = bpy.context.window_manager.photon_bake_views, bake_state(), area.spaces.active.shading
    views.photons = views.cells = True
    shading.color_type, shading.single_color = "SINGLE", (0.05, 0.05, 0.05)
    bpy.context.scene.photon_bake.quality = "draft"
    bpy.context.scene.photon_bake.gather = "light_volume"  # which has cells
    _press_bake(area)
    yield from until(lambda: not state.running, 600)
    yield from wait(2.0)
    yield from picture(ready)
    bpy.utils.unregister_class(opened)
    bpy.utils.register_class(panel)


def bake_state() -> Any:
    """The extension's own state, whatever repository it is installed in."""
    name = next(name for name in sys.modules if name.endswith("photon_bake.addon.ui.state"))
    return sys.modules[name].bake_state


def picture(ready: Path) -> Iterator[None]:
    """Ask for a picture of the screen, and wait until it is taken."""
    ready.touch()
    yield from until(lambda: not ready.exists(), 60)


def wait(seconds: float) -> Any:
    """Let Blender run for a while."""
    end = perf_counter() + seconds
    return until(lambda: perf_counter() > end, seconds + 60)


def until(done: Any, limit: float) -> Any:
    """Let Blender run until `done`; returns the longest that a tick came late."""
    started = last = perf_counter()
    late = 0.0
    while not done():
        if perf_counter() - started > limit:
            raise TimeoutError
        yield
        now = perf_counter()
        late, last = max(late, now - last - TICK), now
    return late


def _load(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def main(show: Callable[[Path], Iterator[None]]) -> None:
    """Play steps from Blender's timer, and quit."""
    bpy.context.preferences.view.show_splash = False
    bpy.context.preferences.view.ui_scale = 1.2
    steps = show(Path(sys.argv[sys.argv.index("--") + 1]).absolute())

    def tick() -> float | None:
        try:
            next(steps)
        except StopIteration:
            bpy.ops.wm.quit_blender()
            return None
        except BaseException:
            import traceback

            traceback.print_exc()
            bpy.ops.wm.quit_blender()
            return None
        return TICK

    bpy.app.timers.register(tick, first_interval=1.0, persistent=True)


if __name__ == "__main__":
    main(show)
