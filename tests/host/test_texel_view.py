"""Lightmaps' texels in the viewport: how many there are a metre, and that a view that is off costs nothing."""

import bpy
import gpu
import numpy as np
import pytest
from mathutils import Matrix
from photon_bake.addon.blender.lightmap.images import lightmaps_by_file
from photon_bake.addon.blender.lightmap.texel_density import texel_surface
from photon_bake.addon.settings.lightmap import LightmapSettings
from photon_bake.addon.ui.views.texel_view import texel_view

from .scenes import add_plane
from .test_debug_views import graphics  # noqa: F401 (a fixture)

SIDE = 64


@pytest.fixture
def floor(empty_scene):
    """A square of 2 m whose lightmap of 64 × 32 texels lies on the right half of an image."""
    obj = add_plane("Floor", size=2.0)
    image = bpy.data.images.new("Lightmap", 64, 32)
    image["photon_bake_lightmap"], image.filepath, image.source = "Floor", "//floor.exr", "GENERATED"
    obj["lightmap_image"], obj["lightmap_uv_map"] = "floor.exr", "UVMap"
    obj["lightmap_scale_offset"] = (0.5, 1.0, 0.5, 0.0)
    yield obj
    texel_view.show(False)


def surface(obj, **settings):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return texel_surface(obj, depsgraph, LightmapSettings(**settings), lightmaps_by_file())


def test_texels_a_metre_of_a_lightmap(floor):
    found = surface(floor)
    assert found.density == pytest.approx(np.sqrt(32 * 32 / 4), rel=1e-5)
    assert found.texel.min(axis=0).tolist() == [32, 0] and found.texel.max(axis=0).tolist() == [64, 32]
    floor.scale = (2, 2, 2)
    assert surface(floor).density == pytest.approx(8, rel=1e-5)


def test_before_the_bake_it_is_what_the_settings_ask_for(floor):
    del floor["lightmap_image"], floor["lightmap_uv_map"]
    assert surface(floor) is None  # no UV map is chosen, and none was made
    assert surface(floor, uv_map="UVMap", density=16.0).density == pytest.approx(16, rel=1e-5)
    floor.photon_bake.density = 2.0
    assert surface(floor, uv_map="UVMap", density=16.0).density == pytest.approx(32, rel=1e-5)
    assert surface(floor, uv_map="UVMap", size=256).density == pytest.approx(128, rel=1e-5)


def test_nothing_listens_while_it_is_off(floor):
    n = len(bpy.app.handlers.depsgraph_update_post)
    bpy.context.window_manager.photon_bake_texels = True
    assert texel_view.shown and len(bpy.app.handlers.depsgraph_update_post) == n + 1
    bpy.context.window_manager.photon_bake_texels = False
    assert not texel_view.shown and len(bpy.app.handlers.depsgraph_update_post) == n


def drawn():
    """The floor from 1 m above, which fills the picture: (SIDE, SIDE, 4)."""
    screen = gpu.types.GPUOffScreen(SIDE, SIDE)
    with screen.bind(), gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
        frame = gpu.state.active_framebuffer_get()
        frame.clear(color=(0, 0, 0, 0), depth=1.0)
        gpu.matrix.load_matrix(Matrix.Identity(4))
        gpu.matrix.load_projection_matrix(Matrix.Diagonal((1, 1, -0.5, 1)))
        texel_view.draw()
        pixels = np.array(frame.read_color(0, 0, SIDE, SIDE, 4, 0, "FLOAT").to_list())
    screen.free()
    return pixels


@pytest.mark.parametrize(("asked", "strongest"), [(16.0, 1), (64.0, 2), (4.0, 0)], ids=["as asked", "few", "many"])
def test_the_colour_says_how_many_texels_there_are(graphics, floor, asked, strongest):  # noqa: F811
    bpy.context.scene.photon_bake.lightmap.density = asked
    texel_view.show(True)
    pixels = drawn()[..., :3]
    assert (pixels.argmax(axis=2) == strongest).all()


def test_squares_are_of_eight_texels_where_one_has_few_pixels(graphics, floor):  # noqa: F811
    texel_view.show(True)
    green = drawn()[SIDE // 2 + 2, :, 1]
    assert np.count_nonzero(np.abs(np.diff(green)) > 0.02) == 32 / 8 - 1
