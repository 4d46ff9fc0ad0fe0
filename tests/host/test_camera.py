"""The camera as Blender has it."""

import bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector
from photon_bake.addon.blender import read_camera
from photon_bake.addon.errors import BakeError


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


@pytest.mark.parametrize("lens", [{"type": "ORTHO"}, {"shift_x": 0.1}])
def test_other_cameras_are_refused_by_name(empty_scene, lens):
    with pytest.raises(BakeError, match="no active camera"):
        read(empty_scene)
    new_camera(empty_scene, **lens)
    with pytest.raises(BakeError, match="'Camera'"):
        read(empty_scene)
