"""A Blender camera as the engine sees it."""

from math import atan, tan
from typing import Any

import numpy as np

from ..errors import BakeError
from ..receivers import Camera


def read_camera(scene: Any, depsgraph: Any) -> Camera:
    """The scene's active camera, with the render's resolution.

    Parameters
    ----------
    scene : bpy.types.Scene
    depsgraph : bpy.types.Depsgraph

    Raises
    ------
    BakeError
        If there is no camera, or it is not a plain perspective one.
    """
    if scene.camera is None:
        raise BakeError(f"Scene '{scene.name}' has no active camera: choose one in the Scene properties.")
    camera = scene.camera.evaluated_get(depsgraph)
    lens, render = camera.data, scene.render
    if lens.type != "PERSP" or lens.shift_x or lens.shift_y or render.pixel_aspect_x != render.pixel_aspect_y:
        raise BakeError(
            f"Camera '{scene.camera.name}' is not a perspective one without shift and with square pixels: make it so."
        )
    width, height = (
        max(1, int(n * render.resolution_percentage / 100)) for n in (render.resolution_x, render.resolution_y)
    )
    world_from_camera = np.array(camera.matrix_world, np.float64)
    right, up, back = (world_from_camera[:3, i] / np.linalg.norm(world_from_camera[:3, i]) for i in range(3))
    return Camera(
        position=world_from_camera[:3, 3].astype(np.float32),
        axes=np.stack([right, up, -back]).astype(np.float32),
        angle=_angle_of_width(lens, width, height),
        width=width,
        height=height,
    )


def _angle_of_width(lens: Any, width: int, height: int) -> float:
    """Field of view across the width, radians, from that across the side that the sensor is fitted to."""
    vertical = lens.sensor_fit == "VERTICAL" or (lens.sensor_fit == "AUTO" and height > width)
    across = 2 * tan((lens.angle_y if lens.sensor_fit == "VERTICAL" else lens.angle) / 2)
    return 2 * atan((across * width / height if vertical else across) / 2)
