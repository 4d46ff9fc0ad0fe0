"""What the last bake leaves for the viewport, and how it is drawn there."""

from types import SimpleNamespace

import bpy
import gpu
import numpy as np
import pytest
from mathutils import Matrix
from photon_bake.addon.core.inspector import MOST_POINTS, VIEWS, Inspector
from photon_bake.addon.ui.views import debug_views as module
from photon_bake.addon.ui.views.debug_views import debug_views
from photon_bake.addon.ui.views.dots import display_colours

from .scenes import add_cube, add_lamp, add_plane

SIDE = 64
"""Of the picture that is drawn into, pixels."""

FAR = 5.0
"""From the eye to z = 0, m; a point at x = 2.5 is drawn half-way between the middle and the edge."""

PROJECTION = Matrix(((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, -1.002, -0.02), (0, 0, -1, 0)))  # clips at 1 cm


@pytest.fixture(autouse=True)
def toggles(empty_scene):
    """What the panel shows; all are off before and after."""
    yield bpy.context.window_manager.photon_bake_views
    for view in VIEWS:
        debug_views.show(view, False)
    debug_views.forget()


@pytest.fixture(scope="module")
def graphics():
    """Graphics without a window."""
    if not hasattr(gpu, "init"):
        pytest.skip("before Blender 5 there are no graphics in the background")
    try:
        gpu.init()
    except SystemError as error:
        pytest.skip(f"there are no graphics here: {error}")


def see(view, position, light=None):
    """Leave points for a view, as a bake does."""
    light = None if light is None else np.array(light, np.float32)
    debug_views.start().see(view, lambda: (np.array(position, np.float32), light))


def drawn(depth=1.0):
    """What the views draw over a surface of a depth: the pixels, (SIDE, SIDE, 4), upwards."""
    screen = gpu.types.GPUOffScreen(SIDE, SIDE)
    with screen.bind(), gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
        frame = gpu.state.active_framebuffer_get()
        frame.clear(color=(0, 0, 0, 0), depth=depth)
        gpu.matrix.load_matrix(Matrix.Translation((0, 0, -FAR)))
        gpu.matrix.load_projection_matrix(PROJECTION)
        debug_views.draw()
        pixels = np.array(frame.read_color(0, 0, SIDE, SIDE, 4, 0, "FLOAT").to_list())
    screen.free()
    return pixels


def depth_of(z):
    """What the depth buffer holds for a point on the eye's axis."""
    clip = PROJECTION @ Matrix.Translation((0, 0, -FAR)) @ Matrix.Translation((0, 0, z)).col[3]
    return (clip.z / clip.w + 1) / 2


def test_an_inspector_keeps_what_is_wanted_and_not_more():
    inspector = Inspector({"photons"})
    inspector.see("cells", lambda: pytest.fail("nobody asked for it"))
    position = np.arange(3 * (MOST_POINTS + 5), dtype=np.float32).reshape(-1, 3)
    inspector.see("photons", lambda: (position, position))
    seen = inspector.seen["photons"]
    assert set(inspector.seen) == {"photons"} and seen.n_all == len(position) and len(seen.position) == MOST_POINTS
    assert np.array_equal(seen.position[[0, -1]], position[[0, -1]]) and np.array_equal(seen.light, seen.position)


@pytest.mark.parametrize("n", [0, 1, 7])
def test_an_inspector_copies_a_few_points_as_they_are(n):
    inspector, position = Inspector(VIEWS), np.random.default_rng(n).random((n, 3)).astype(np.float32)
    before = position.copy()
    inspector.see("maps", lambda: (position, None))
    position += 1
    assert np.array_equal(inspector.seen["maps"].position, before) and inspector.seen["maps"].light is None


def test_colours_are_bright_where_light_is():
    light = np.array([[4, 0, 0], [2, 4, 4], [0, 0, 0], [0.4, 0.4, 0.4]], np.float32)
    colours = display_colours(light)
    assert colours[0] == pytest.approx([1, 0, 0], abs=0.01) and (colours[1, 1:] > 0.99).all()
    assert (colours[2] == 0).all() and 0.1 < colours[3, 0] < 0.5
    assert (display_colours(np.zeros((2, 3), np.float32)) == 0).all() and len(display_colours(light[:0])) == 0


def test_toggles_say_what_is_shown(toggles):
    assert not (toggles.maps or toggles.photons or toggles.cells)
    toggles.photons = True
    assert toggles.photons and debug_views.shown == {"photons"}
    toggles.photons = False
    assert debug_views.shown == set()


def test_blender_calls_only_while_something_is_shown(toggles, monkeypatch):
    handlers = []
    space = SimpleNamespace(
        draw_handler_add=lambda draw, *_: handlers.append(draw) or draw,
        draw_handler_remove=lambda draw, _: handlers.remove(draw),
    )
    window = SimpleNamespace(
        app=SimpleNamespace(background=False), types=SimpleNamespace(SpaceView3D=space), context=bpy.context
    )
    monkeypatch.setattr(module, "bpy", window)
    toggles.photons = toggles.cells = True
    assert handlers == [debug_views.draw]
    toggles.photons = False
    assert handlers == [debug_views.draw]
    toggles.cells = False
    assert handlers == []


def test_in_the_background_blender_never_calls(toggles, monkeypatch):
    monkeypatch.setattr(module, "bpy", SimpleNamespace(app=bpy.app, types=None, context=bpy.context))
    toggles.maps = True
    toggles.maps = False


def test_another_file_makes_the_views_forget(toggles):
    toggles.maps = True
    see("maps", [[0, 0, 0]])
    assert "maps" in debug_views.inspector.seen
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert debug_views.inspector.seen == {} and bpy.context.window_manager.photon_bake_views.maps


def test_a_bake_leaves_what_is_shown(toggles):
    add_plane("Floor", size=8.0)
    add_cube("Box").location.z = 1.0
    add_lamp("POINT", location=(1.5, 0.5, 4), energy=1000)
    properties = bpy.context.scene.photon_bake
    properties.gather, properties.tracer = "light_volume", "multi_image"
    properties.n_photons, properties.n_grid_cells, properties.n_maps, properties.map_size = 5000, 12, 8, 16
    for shown in (set(VIEWS), {"cells"}, set()):
        for view in VIEWS:
            setattr(toggles, view, view in shown)
        assert bpy.ops.photon_bake.bake_indirect() == {"FINISHED"}
        assert set(debug_views.inspector.seen) == shown
        for view, points in debug_views.inspector.seen.items():
            assert points.n_all > 5 and np.isfinite(points.position).all()
            assert (points.light is None) == (view == "maps")


@pytest.mark.parametrize("view", VIEWS)
def test_points_are_drawn_where_they_are(graphics, view):
    debug_views.show(view, True)
    see(view, [[-2.5, 2.5, 0]], [[0, 0, 3]] if view != "maps" else None)
    pixels = drawn()
    y, x = np.nonzero(pixels[..., 3])
    assert abs(y.mean() + 0.5 - 48) < 1 and abs(x.mean() + 0.5 - 16) < 1 and 4 <= len(x) <= 200
    colour = pixels[48, 16, :3]
    assert colour == pytest.approx((1, 0.5, 0.1) if view == "maps" else (0, 0, 1), abs=0.01)


def test_what_is_not_shown_is_not_drawn(graphics):
    debug_views.show("photons", True)
    see("photons", [[0, 0, 0]], [[1, 1, 1]])
    assert drawn().any()
    debug_views.show("photons", False)
    assert not drawn().any()
    debug_views.show("photons", True)
    assert drawn().any()
    debug_views.start()
    assert not drawn().any()


def test_surfaces_hide_photons_but_not_maps(graphics):
    for view, hidden in (("photons", True), ("maps", False)):
        debug_views.show(view, True)
        see(view, [[0, 0, 0]], [[1, 1, 1]] if view == "photons" else None)
        assert drawn().any() and drawn(depth_of(0.5)).any() != hidden
