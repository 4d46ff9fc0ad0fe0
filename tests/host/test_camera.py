"""The camera as Blender has it."""

import bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector
from photon_bake.addon.blender import read_camera
from photon_bake.addon.blender.read.camera import read_frame, read_pixel_filter, render_camera
from photon_bake.addon.core.errors import BakeError, kind_of
from photon_bake.addon.receivers import seen_surface
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.host import scenes
from photon_bake.tests.host.cycles_passes import render_passes
from photon_bake.tests.host.scenes import add_material, add_plane


def new_camera(scene, **lens):
    data = bpy.data.cameras.new("Camera")
    for name, value in lens.items():
        setattr(data, name, value)
    camera = bpy.data.objects.new("Camera", data)
    camera.location, camera.rotation_euler, camera.scale = (1, -3, 2), (1.1, 0.2, 0.4), (1, 2, 0.5)
    scene.collection.objects.link(camera)
    scene.camera = camera
    return camera


def read(scene):
    return read_camera(scene, bpy.context.evaluated_depsgraph_get())


@pytest.mark.parametrize("size", [(160, 90), (60, 100)])
@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
def test_points_fall_where_blender_sees_them(empty_scene, fit, size):
    render = empty_scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = size[0] * 2, size[1] * 2, 50
    new_camera(empty_scene, sensor_fit=fit, lens=35, sensor_width=30, sensor_height=20)
    camera = read(empty_scene)
    assert (camera.width, camera.height) == size
    points = np.random.default_rng(0).uniform(-4, 4, (300, 3)).astype(np.float32)
    pixels = camera.pixels(points)
    seen = 0
    for point, pixel in zip(points, pixels, strict=True):
        x, y, depth = world_to_camera_view(empty_scene, empty_scene.camera, Vector(point))
        inside = depth > 0 and 0 <= x < 1 and 0 <= y < 1
        seen += inside
        assert pixel == (int((1 - y) * size[1]) * size[0] + int(x * size[0]) if inside else -1)
    assert seen > 10


def a_room_of_facets(scene):
    """An icosphere around the camera, squeezed, and a smaller one in view of it."""
    for radius, place in ((5, (1, -3, 2)), (0.7, (0.2, -1, 1.6))):
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=radius, location=place)
        bpy.context.object.scale = (1, 0.8, 0.6)


LENSES = {
    "perspective": {},
    "portrait": {"render": {"resolution_x": 20, "resolution_y": 34}},
    "shift": {"shift_x": 0.3, "shift_y": -0.2},
    "shift of a fitted height": {"shift_x": 0.3, "shift_y": -0.2, "sensor_fit": "VERTICAL"},
    "wide pixels": {"render": {"pixel_aspect_x": 2.0}, "shift_y": 0.1},
    "tall pixels": {"render": {"pixel_aspect_y": 1.5}},
    "orthographic": {"type": "ORTHO", "ortho_scale": 5.0},
    "orthographic shift": {"type": "ORTHO", "ortho_scale": 5.0, "shift_x": -0.2, "render": {"pixel_aspect_y": 1.4}},
    "clipping": {"clip_start": 2.2, "clip_end": 3.4},
    "orthographic clipping": {"type": "ORTHO", "clip_start": 2.2, "clip_end": 3.4},
    "equirectangular": {"type": "PANO", "panorama_type": "EQUIRECTANGULAR", "shift_x": 0.2},
    "part of a panorama": {
        "type": "PANO",
        "panorama_type": "EQUIRECTANGULAR",
        "longitude_min": -1.0,
        "longitude_max": 0.5,
        "latitude_min": -0.9,
        "latitude_max": 1.2,
    },
    "equidistant": {"type": "PANO", "panorama_type": "FISHEYE_EQUIDISTANT", "fisheye_fov": 2.6, "shift_y": 0.1},
    "equisolid": {"type": "PANO", "panorama_type": "FISHEYE_EQUISOLID", "fisheye_lens": 8.0, "fisheye_fov": 2.8},
    "equisolid portrait": {
        "type": "PANO",
        "panorama_type": "FISHEYE_EQUISOLID",
        "fisheye_lens": 8.0,
        "render": {"resolution_x": 20, "resolution_y": 34},
    },
    "region": {
        "render": {
            "use_border": True,
            "use_crop_to_border": True,
            "border_min_x": 0.21,
            "border_max_x": 0.77,
            "border_min_y": 0.13,
            "border_max_y": 0.58,
        }
    },
    "region in the frame": {
        "render": {"use_border": True, "border_min_x": 0.21, "border_max_x": 0.77, "border_min_y": 0.13},
        "shift_x": 0.1,
    },
}


@pytest.mark.parametrize("name", LENSES)
def test_rays_are_those_of_cycles(empty_scene, tmp_path, name):
    """Depth and normal in every pixel; the tolerance of 1 % of pixels is for those that an edge runs through."""
    lens, render = dict(LENSES[name]), empty_scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 34, 20, 100
    for knob, value in lens.pop("render", {}).items():
        setattr(render, knob, value)
    new_camera(empty_scene, **lens)
    a_room_of_facets(empty_scene)
    layer = empty_scene.view_layers[0]
    layer.use_pass_z = layer.use_pass_normal = layer.use_pass_position = True
    cycles = render_passes(empty_scene, tmp_path / "cycles.exr", filter_width=0.01)

    camera, frame = read(empty_scene), read_frame(empty_scene)
    scene = scenes.extracted(for_camera=True)
    seen = seen_surface(scene, TransparencyTracer(scene, EmbreeTracer(scene)), camera)
    row, column = np.divmod(seen.pixel, camera.width)
    there = np.zeros((frame.height, frame.width), bool)
    there[row + frame.row, column + frame.column] = True
    depth = cycles["Depth.V" if "Depth.V" in cycles else "Depth.Z"]
    assert depth.shape == there.shape
    rendered = (depth > 0) & (depth < 1e9)
    assert (rendered != there).mean() < 0.01
    at = row + frame.row, column + frame.column
    same = rendered[at]
    ours = camera.depth(seen.position)
    normal = np.stack([cycles[f"Normal.{axis}"][at] for axis in "XYZ"], axis=1)
    position = np.stack([cycles[f"Position.{axis}"][at] for axis in "XYZ"], axis=1)
    assert (np.abs(ours - depth[at])[same] > 1e-3 * depth[at][same]).mean() < 0.01
    assert (np.abs(seen.position - position)[same] > 5e-3).any(axis=1).mean() < 0.01
    assert (np.abs(seen.normal - normal)[same] > 1e-3).any(axis=1).mean() < 0.01
    assert same.sum() > 50
    # and back: what is seen through a pixel falls into it, but for what lies on its edges
    assert np.mean(camera.pixels(seen.position) == seen.pixel) > 0.99


def test_what_is_no_camera_is_refused_by_name(empty_scene):
    with pytest.raises(BakeError, match="no active camera"):
        read(empty_scene)
    camera = new_camera(empty_scene, type="PANO", panorama_type="MIRRORBALL")
    with pytest.raises(BakeError, match=r"'Camera'.*MIRRORBALL"):
        read(empty_scene)
    camera.data.type = "PERSP"
    render = empty_scene.render
    render.use_border, render.border_min_x, render.border_max_x = True, 0.5, 0.5
    with pytest.raises(BakeError, match=r"render region.*no pixel"):
        read(empty_scene)
    empty = bpy.data.objects.new("Empty", None)
    empty_scene.collection.objects.link(empty)
    empty_scene.camera = empty
    with pytest.raises(BakeError, match="'Empty' is no camera"):
        read(empty_scene)


def test_depth_of_field_is_told(empty_scene):
    new_camera(empty_scene).data.dof.use_dof = True
    warnings = []
    read_camera(empty_scene, bpy.context.evaluated_depsgraph_get(), warnings)
    assert len(warnings) == 1 and "'Camera'" in warnings[0]


@pytest.mark.parametrize("kind", ["BLACKMAN_HARRIS", "GAUSSIAN", "BOX"])
def test_pixel_filter_is_the_engine_s(empty_scene, tmp_path, kind):
    """An edge, a little turned, as Cycles filters it, and by offsets on a grid over the filter."""
    render = empty_scene.render
    render.resolution_x = render.resolution_y = 24
    material, _ = add_material(node="ShaderNodeEmission")
    add_plane(size=100, material=material).location = (50, 0, -5)
    camera = new_camera(empty_scene, type="ORTHO", ortho_scale=24)
    camera.location, camera.rotation_euler, camera.scale = (0, 0, 0), (0, 0, 0.1), (1, 1, 1)
    cycles = render_passes(empty_scene, tmp_path / "edge.exr", 64, filter_width=1.4, pixel_filter=kind)["Combined.R"]
    middles = np.arange(24) - 11.5
    offsets = read_pixel_filter(empty_scene).offsets((np.arange(100) + 0.5) / 100)
    x, y = middles[None, :, None, None] + offsets[:, None], middles[::-1, None, None, None] + offsets
    ours = (x * np.cos(0.1) > y * np.sin(0.1)).mean(axis=(2, 3))
    assert np.sqrt(((cycles - ours) ** 2).mean()) < 0.01


@pytest.mark.parametrize(("frame", "hidden", "name"), [(1, "", "B"), (3, "", "B"), (8, "", "C"), (8, "C", "B")])
def test_markers_choose_the_camera_as_in_renders(empty_scene, frame, hidden, name):
    cameras = {one: new_camera(empty_scene) for one in "ABC"}
    for one, camera in cameras.items():
        camera.name, camera.hide_render = one, one == hidden
    empty_scene.frame_set(frame)
    empty_scene.timeline_markers.new("b", frame=3).camera = cameras["B"]
    empty_scene.timeline_markers.new("c", frame=7).camera = cameras["C"]
    empty_scene.camera = cameras["A"]
    assert render_camera(empty_scene).name == name
    empty_scene.render.engine, empty_scene.cycles.samples = "CYCLES", 1
    empty_scene.render.resolution_x = empty_scene.render.resolution_y = 4
    bpy.ops.render.render()  # which makes it the scene's
    assert empty_scene.camera.name == name


def test_stereoscopy_is_named(empty_scene):
    new_camera(empty_scene)
    empty_scene.render.use_multiview = True
    warnings = []
    read_camera(empty_scene, bpy.context.evaluated_depsgraph_get(), warnings)
    (warning,) = warnings
    assert "several views ('left', 'right')" in warning and kind_of(warning) == "difference"
