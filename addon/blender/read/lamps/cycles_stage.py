"""Scenes of our own in which Cycles renders worlds and lamps; all of it is removed afterwards."""

from collections.abc import Iterator
from contextlib import contextmanager
from math import pi
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
import numpy as np
from mathutils import Euler, Matrix

from ...temporary import CyclesError, Temporary, cycles_scene

LOOKING_ALONG_X = Euler((pi / 2, 0, -pi / 2)).to_matrix().to_4x4()
"""The middle of a panorama, as in Cycles' Environment Texture."""

_HANDLERS = ["frame_change_pre", "frame_change_post", "render_init", "render_pre", "render_post", "render_write"]
_HANDLERS += ["render_stats", "render_complete", "render_cancel"]


@contextmanager
def left_as_it_was() -> Iterator[Temporary]:
    """Temporary data-blocks, while nobody else is told of the renders."""
    handlers = {name: list(getattr(bpy.app.handlers, name)) for name in _HANDLERS}
    results = {image.name for image in bpy.data.images if image.type == "RENDER_RESULT"}
    with Temporary() as temporary:
        try:
            for name in _HANDLERS:
                getattr(bpy.app.handlers, name).clear()
            yield temporary
        finally:
            for name, functions in handlers.items():
                getattr(bpy.app.handlers, name).extend(functions)
            for image in bpy.data.images:
                if image.type == "RENDER_RESULT" and image.name not in results:
                    temporary.add(image)


def stage(like: "bpy.types.Scene", temporary: Temporary) -> "bpy.types.Scene":
    """An empty scene at the frame of another one, of which Cycles renders direct light as it is."""
    scene = cycles_scene(like, temporary)
    render, cycles = scene.render, scene.cycles
    render.resolution_percentage = 100
    render.use_compositing = render.use_sequencer = render.use_file_extension = False
    settings = render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
    cycles.pixel_filter_type, cycles.use_denoising, cycles.max_bounces = "BOX", False, 0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    return scene


def panorama(
    scene: "bpy.types.Scene",
    temporary: Temporary,
    size: tuple[int, int],
    pose: "Matrix | None" = None,
    angle: float = pi,
) -> None:
    """Give a scene a camera that sees all around, in pixels (width, height); rows go from below up to an angle, rad."""
    camera = temporary.add(bpy.data.cameras.new("Photon Bake"))
    camera.type, camera.clip_start = "PANO", 1e-4
    lens = camera if hasattr(camera, "panorama_type") else camera.cycles
    lens.panorama_type, lens.latitude_max = "EQUIRECTANGULAR", angle - pi / 2
    scene.camera = temporary.add(bpy.data.objects.new("Photon Bake", camera))
    scene.camera.matrix_world = (pose or Matrix()) @ LOOKING_ALONG_X
    scene.collection.objects.link(scene.camera)
    scene.render.resolution_x, scene.render.resolution_y = size


def shot(scene: "bpy.types.Scene", n_samples: int) -> np.ndarray:
    """One render of a scene, (h, w, 3) float32.

    Raises
    ------
    CyclesError
    """
    scene.cycles.samples = n_samples
    with Temporary() as temporary, TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder, "light.exr"))
        try:
            bpy.ops.render.render(scene=scene.name, write_still=True)
            image = temporary.add(bpy.data.images.load(scene.render.filepath))
        except RuntimeError as error:
            raise CyclesError(str(error).strip()) from error
        width, height = image.size
        pixels = np.empty(width * height * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(height, width, -1)[..., :3]
    return np.nan_to_num(pixels, posinf=0.0, neginf=0.0)
