"""Live light as shaders draw it: what a pixel's colour is made of, against arithmetic."""

import bpy
import gpu
import numpy as np
import pytest
from photon_bake.addon.blender.viewport import shaders, view_transform
from photon_bake.addon.blender.viewport.drawing import SKY, SURFACES, Drawing, Scenery, View
from photon_bake.addon.blender.viewport.looks import Looks
from photon_bake.addon.blender.viewport.view_transform import ViewTransform
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.scene import Channel, Materials, Textures, World

from .live_stand_ins import Surfaces, light_on, square
from .test_debug_views import graphics  # noqa: F401 (a fixture)

SIDE = 32

ABOVE = View(
    np.array([(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, -5), (0, 0, 0, 1)], float),
    np.array([(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, -0.1, -0.5), (0, 0, 0, 1)], float),
    False,
)
"""Orthographic from z = 5 down on x and y in [−1, 1]; z from 10 to −10."""

PERSPECTIVE = View(
    np.array([(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, -1), (0, 0, 0, 1)], float),
    np.array([(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, -1.002, -0.2002), (0, 0, -1, 0)], float),
    True,
)
"""From z = 1, where the picture's edges are at x and y = ±1 on z = 0."""


@pytest.fixture
def drawing(graphics):  # noqa: F811
    one = Drawing(lambda: None, pytest.fail)
    yield one
    one.end()


def scenery(surfaces=None, materials=None, world=0.0, shown_as=None, mode="colored", **light):
    surfaces = surfaces or Surfaces(square())
    materials = materials or Materials.matte_of(np.array([[0.5, 0.25, 0.125]]))
    world = world if isinstance(world, World) else World.constant(world)
    n = len(surfaces.meshes)
    return Scenery(
        scene=0,
        layer="",
        light=light_on(surfaces, **light),
        looks=Looks.of(materials),
        transforms=np.tile(np.eye(4, dtype=np.float32), (n, 1, 1)),
        world=world,
        shown_as=shown_as or ViewTransform(1.0, None),
        mode=mode,
        shown_in=lambda space: np.ones(n, bool),
    )


def drawn(drawing, what, view=ABOVE, shown=None, depth=1.0, **options):
    """The pixels, (SIDE, SIDE, 4), upwards; linear, as in the image of the surfaces."""
    color = gpu.types.GPUTexture((SIDE, SIDE), format="RGBA32F")
    depths = gpu.types.GPUTexture((SIDE, SIDE), format="DEPTH_COMPONENT32F")
    frame = gpu.types.GPUFrameBuffer(color_slots=(color,), depth_slot=depths)
    with frame.bind():
        frame.clear(color=(0.5, 0, 0.5, 0), depth=depth)
        drawing.draw(what, view, np.ones(len(what.transforms), bool) if shown is None else shown, **options)
        return np.array(frame.read_color(0, 0, SIDE, SIDE, 4, 0, "FLOAT").to_list())


@pytest.mark.parametrize(
    ("mode", "color"),
    [("colored", (0.75, 0.375, 0.1875)), ("indirect", (0.5, 0.5, 0.5)), ("light", (1.5, 1.5, 1.5))],
)
@pytest.mark.parametrize("view", [ABOVE, PERSPECTIVE], ids=["orthographic", "perspective"])
def test_a_matte_surface_is_its_colour_times_the_light(drawing, mode, color, view):
    pixels = drawn(drawing, scenery(mode=mode, shown_as=ViewTransform(0.5, None)), view)
    assert pixels[..., :3] == pytest.approx(np.broadcast_to(np.multiply(color, 0.5), (SIDE, SIDE, 3)), rel=1e-3)
    assert (pixels[..., 3] == 1).all()


def test_newer_light_is_drawn(drawing):
    surfaces = Surfaces(square())
    before = scenery(surfaces, direct=0.2, indirect=0.0)
    after = scenery(surfaces, direct=0.8, indirect=0.0)
    for what, light in ((before, 0.2), (after, 0.8)):
        assert drawn(drawing, what)[16, 16, 0] == pytest.approx(0.5 * light, rel=1e-3)


def test_an_object_is_drawn_where_it_was_moved_to(drawing):
    what = scenery()
    what.transforms[0, 0, 3] = 1.0
    red = drawn(drawing, what)[16, :, 0]
    assert (red[:15] == 0).all() and (red[17:] > 0.5).all()


def test_hidden_objects_and_those_behind_what_solid_drew_are_not_drawn(drawing):
    what = scenery(Surfaces(square(0, 0, 1.0, 1.0), square(1, 4, 0.0)), direct=1.0, indirect=0.0)
    what.light.direct[:4] = 0.1
    assert drawn(drawing, what)[16, 16, 0] == pytest.approx(0.05, rel=1e-3)
    assert drawn(drawing, what, shown=np.array([False, True]))[16, 16, 0] == pytest.approx(0.5, rel=1e-3)
    assert drawn(drawing, what, depth=0.1)[16, 16, 0] == 0.5  # as it was


def test_what_lies_where_solid_drew_it_covers_it(drawing):
    """At any depth, though Blender and we round differently."""
    for view, near in ((ABOVE, 0.5), (PERSPECTIVE, 0.9009)):
        for off in (0.0, 2e-6, 1e-5):
            pixels = drawn(drawing, scenery(), view, depth=near - off)
            assert (pixels[..., 0] > 0.7).all()


def test_the_world_is_behind(drawing):
    what = scenery(Surfaces(square(side=1.0)), world=np.array([0.1, 0.2, 0.3], np.float32))
    pixels = drawn(drawing, what)
    assert pixels[0, 0, :3] == pytest.approx((0.1, 0.2, 0.3), rel=1e-3) and pixels[16, 16, 0] == pytest.approx(
        0.75, rel=1e-3
    )


def test_a_world_picture_lies_as_cycles_has_it(drawing):
    """Row 0 looks down, column u along the azimuth π − 2πu."""
    height, width = 64, 128
    z = -np.cos(np.pi * (np.arange(height) + 0.5) / height)[:, None]
    azimuth, r = np.pi - 2 * np.pi * (np.arange(width) + 0.5) / width, np.sqrt(1 - z * z)
    toward = np.stack(np.broadcast_arrays(r * np.cos(azimuth), r * np.sin(azimuth), z), axis=-1)
    what = scenery(Surfaces(square(side=1e-3, z=-9)), world=World(np.ones(3, np.float32), toward * 0.5 + 0.5))
    pixels = drawn(drawing, what, PERSPECTIVE)[..., :3] * 2 - 1
    at = (np.arange(SIDE) + 0.5) / SIDE * 2 - 1
    x, y = np.meshgrid(at, at)
    wanted = np.stack([x, y, -np.ones_like(x)], axis=-1)
    wanted /= np.linalg.norm(wanted, axis=-1, keepdims=True)
    assert np.abs(pixels - wanted).max() < 0.02


def test_images_repeat_or_extend(drawing):
    image = np.arange(4, dtype=np.float32).reshape(2, 2, 1).repeat(3, 2) / 4
    for extends in (False, True):
        diffuse = Channel(np.ones((1, 3), np.float32), np.zeros(1, np.int32))
        materials = Materials.of(1, Textures.pack([image], [extends]), diffuse=diffuse)
        what = scenery(materials=materials, direct=1.0, indirect=0.0)
        what.light.surfaces.meshes[0].uv[:] *= 2
        pixels = drawn(drawing, what)[..., 0]
        middles = pixels[4::8, 4::8]  # of the texels, twice each way
        wanted = np.array([[0, 0.25], [0.5, 0.75]])
        wanted = np.pad(wanted, ((0, 2), (0, 2)), "edge") if extends else np.tile(wanted, (2, 2))
        assert middles == pytest.approx(wanted, abs=0.13)


def test_half_a_cut_out_shows_what_is_behind(drawing):
    materials = Materials.of(2, diffuse=Channel.constant([1.0, 0.25]), coverage=Channel.constant([0.5, 1.0]))
    what = scenery(Surfaces(square(0, 0, 1.0), square(1, 4, 0.0, material=1)), materials, direct=1.0, indirect=0.0)
    assert what.looks.see_through
    red = drawn(drawing, what, depth=0.45)[..., 0]  # as Solid drew the upper one
    assert set(np.round(red.ravel(), 3)) == {1.0, 0.25} and red.mean() == pytest.approx(0.625)


def test_emission_adds_to_the_light(drawing):
    materials = Materials.matte_of(np.array([[0.5] * 3]), np.array([[0.25, 0, 0]]))
    assert drawn(drawing, scenery(materials=materials))[16, 16, :3] == pytest.approx((1.0, 0.75, 0.75), rel=1e-3)
    assert drawn(drawing, scenery(materials=materials, mode="indirect"))[16, 16, 0] == pytest.approx(0.5, rel=1e-3)


@pytest.mark.parametrize("transform", ["AgX", "Filmic", "Standard"])
def test_colours_are_those_that_blender_saves(drawing, transform):
    view = bpy.context.scene.view_settings
    view.view_transform, view.exposure, view.gamma = transform, 1.0, 1.2
    table = view_transform.table_of(bpy.context.scene)
    shown_as = ViewTransform(view_transform.exposure_of(bpy.context.scene), table)
    colors = np.array([[[0.18, 0.18, 0.18], [0.02, 0.4, 0.1], [1.5, 0.9, 0.05], [9, 9, 9]]])
    wanted = view_transform.transformed(bpy.context.scene, colors * 2)[0]
    for color, right in zip(colors[0], wanted, strict=True):
        what = scenery(Surfaces(square(side=1e-3)), world=color.astype(np.float32), shown_as=shown_as)
        shown = drawn(drawing, what)[0, 0, :3]
        encoded = np.where(shown < 0.0031308, shown * 12.92, 1.055 * np.maximum(shown, 1e-9) ** (1 / 2.4) - 0.055)
        assert encoded == pytest.approx(right, abs=2 / 255)


def test_the_standard_transform_needs_no_table():
    view = bpy.context.scene.view_settings
    view.view_transform = "Standard"
    n = len(bpy.data.scenes), len(bpy.data.images)
    assert view_transform.table_of(bpy.context.scene) is None
    key = view_transform.key_of(bpy.context.scene)
    view.view_transform = "AgX"
    table = view_transform.table_of(bpy.context.scene)
    assert table.shape == (64, 64, 64, 3) and view_transform.key_of(bpy.context.scene) != key
    assert (len(bpy.data.scenes), len(bpy.data.images)) == n


@pytest.mark.parametrize("shader", [SKY, SURFACES], ids=["sky", "surfaces"])
def test_shaders_compile(graphics, shader):  # noqa: F811
    assert shader.compiled().of is shader


def test_a_shader_that_does_not_compile_says_what_the_driver_says(graphics, tmp_path, monkeypatch):  # noqa: F811
    for path in shaders._FOLDER.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "sky.frag.glsl").write_text("void main() { color = vec4(no_such_name); }")
    monkeypatch.setattr(shaders, "_FOLDER", tmp_path)
    with pytest.raises(BakeError, match=r"does not compile the shader 'sky' .*no_such_name"):
        SKY.compiled()
