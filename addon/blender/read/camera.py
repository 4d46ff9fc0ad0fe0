"""A Blender camera as the engine sees it."""

from typing import Any

import numpy as np

from ...core.errors import BakeError
from ...output.camera import PictureFrame
from ...receivers import Camera, Equirectangular, Fisheye, Lens, Orthographic, Perspective, PixelFilter
from ...receivers.camera.pixel_filter import FilterKind

Window = tuple[float, float, float, float]

_PANORAMAS = ("EQUIRECTANGULAR", "FISHEYE_EQUIDISTANT", "FISHEYE_EQUISOLID")
_FILTERS: dict[str, tuple[FilterKind, float]] = {
    "BOX": ("box", 1.0),
    "GAUSSIAN": ("gaussian", 3.0),
    "BLACKMAN_HARRIS": ("blackman_harris", 2.0),
}
"""By Cycles' name: the filter, and how much wider it is from end to end than its Width says."""


def read_camera(scene: Any, depsgraph: Any, warnings: list[str] | None = None) -> Camera:
    """The camera that renders look through, with what they show of its picture: the render region, if there is one.

    Parameters
    ----------
    scene : bpy.types.Scene
    depsgraph : bpy.types.Depsgraph
    warnings : list of str, optional
        Sentences about what is not taken from it are appended.

    Raises
    ------
    BakeError
        If there is no camera, its kind is not known, or the render region is empty.
    """
    original = render_camera(scene)
    if original is None:
        raise BakeError(f"Scene '{scene.name}' has no active camera: choose one in the Scene properties.")
    camera = original.evaluated_get(depsgraph)
    data, name = camera.data, original.name
    if original.type != "CAMERA":
        raise BakeError(f"Object '{name}' is no camera, though the scene looks through it: choose a camera.")
    if data.dof.use_dof and warnings is not None:
        warnings.append(f"Camera '{name}' has depth of field, which the pass does not have: it is sharp everywhere.")
    if scene.render.use_multiview and warnings is not None:
        views = ", ".join(f"'{view.name}'" for view in scene.render.views if view.use)
        warnings.append(
            f"Scene '{scene.name}' renders several views ({views}), of which the pass has none: it is seen from camera "
            f"'{name}' itself."
        )
    width, height = _resolution(scene.render)
    first_column, last_column, first_row, last_row = _region(scene, width, height)
    lens, (left, right, bottom, top) = _lens_and_window(scene, data, name, width, height)
    across, up = (right - left) / width, (top - bottom) / height
    world_from_camera = np.array(camera.matrix_world, np.float64)
    axes = world_from_camera[:3, :3].T
    right_axis, up_axis, back = axes / np.maximum(np.linalg.norm(axes, axis=1, keepdims=True), 1e-30)
    return Camera(
        position=world_from_camera[:3, 3].astype(np.float32),
        axes=np.stack([right_axis, up_axis, -back]).astype(np.float32),
        lens=lens,
        window=(
            left + first_column * across,
            left + last_column * across,
            top - last_row * up,
            top - first_row * up,
        ),
        width=last_column - first_column,
        height=last_row - first_row,
        clip=(data.clip_start, data.clip_end),
    )


def render_camera(scene: Any) -> Any:
    """The object that renders of the current frame look through; None where there is none.

    Markers that have a camera choose it: the last one up to this frame, else the first of all.
    """
    markers = [one for one in scene.timeline_markers if one.camera and not one.camera.hide_render]
    begun = [one for one in markers if one.frame <= scene.frame_current]
    if begun:
        return max(begun, key=lambda one: one.frame).camera
    return min(markers, key=lambda one: one.frame).camera if markers else scene.camera


def read_frame(scene: Any) -> PictureFrame:
    """Where what `read_camera` shows lies in the picture that a render of the scene writes."""
    render = scene.render
    width, height = _resolution(render)
    first_column, last_column, first_row, last_row = _region(scene, width, height)
    if render.use_border and render.use_crop_to_border:
        return PictureFrame(last_column - first_column, last_row - first_row)
    return PictureFrame(width, height, first_column, first_row)


def read_pixel_filter(scene: Any) -> PixelFilter:
    """The filter by which the scene's engine makes pixels of samples."""
    if scene.render.engine != "CYCLES":
        return PixelFilter("blackman_harris", 2 * scene.render.filter_size)  # a radius
    kind, widen = _FILTERS[scene.cycles.pixel_filter_type]
    return PixelFilter(kind, 1.0 if kind == "box" else widen * scene.cycles.filter_width)


def _resolution(render: Any) -> tuple[int, int]:
    """Width and height of the whole picture, pixels, as Blender rounds them."""
    width, height = (n * render.resolution_percentage // 100 for n in (render.resolution_x, render.resolution_y))
    return max(1, width), max(1, height)


def _region(scene: Any, width: int, height: int) -> tuple[int, int, int, int]:
    """First column, end of the columns, first row and end of the rows that are rendered, from the upper left."""
    render = scene.render
    if not render.use_border:
        return 0, width, 0, height
    left, right = int(render.border_min_x * width), int(render.border_max_x * width)
    bottom, top = int(render.border_min_y * height), int(render.border_max_y * height)
    if right <= left or top <= bottom:
        raise BakeError(f"The render region of scene '{scene.name}' has no pixel in it: draw a larger one.")
    return left, right, height - top, height - bottom


def _lens_and_window(scene: Any, data: Any, name: str, width: int, height: int) -> tuple[Lens, Window]:
    """The lens of a camera's data, and what of its plane the whole picture shows."""
    lens: Lens
    if data.type == "PANO":
        lens, (left, right, bottom, top) = _panorama(data, name, width, height)
        across, up = (right - left) * data.shift_x, (top - bottom) * data.shift_y
        if isinstance(lens, Equirectangular):
            lens = Equirectangular((left + right) / 2 + across)
        return lens, (left + across, right + across, bottom + up, top + up)
    corners = np.array(data.view_frame(scene=scene), np.float64)
    lens = Orthographic()
    if data.type == "PERSP":
        lens, corners = Perspective(), corners / -corners[:, 2:]
    elif data.type != "ORTHO":
        raise BakeError(f"Camera '{name}' is of the kind {data.type}: make it perspective, orthographic or panoramic.")
    (left, bottom), (right, top) = corners[:, :2].min(axis=0), corners[:, :2].max(axis=0)
    return lens, (left, right, bottom, top)


def _panorama(data: Any, name: str, width: int, height: int) -> tuple[Lens, Window]:
    """The same for a panoramic camera that is not shifted."""
    if data.panorama_type == "EQUIRECTANGULAR":
        return Equirectangular(), (data.longitude_min, data.longitude_max, data.latitude_min, data.latitude_max)
    angle = data.fisheye_fov
    if data.panorama_type == "FISHEYE_EQUIDISTANT":
        return Fisheye(angle), (-angle / 2, angle / 2, -angle / 2, angle / 2)
    if data.panorama_type == "FISHEYE_EQUISOLID":
        across, up = _sensor(data, width, height)
        return Fisheye(angle, data.fisheye_lens), (-across / 2, across / 2, -up / 2, up / 2)
    raise BakeError(
        f"The panorama of camera '{name}' is of the kind {data.panorama_type}: choose one of {', '.join(_PANORAMAS)}."
    )


def _sensor(data: Any, width: int, height: int) -> tuple[float, float]:
    """Width and height of the sensor, mm, as Cycles fits them."""
    if data.sensor_fit != "AUTO":
        return data.sensor_width, data.sensor_height
    if width >= height:
        return data.sensor_width, data.sensor_width * height / width
    return data.sensor_width * width / height, data.sensor_width
