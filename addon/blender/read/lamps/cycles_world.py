"""Worlds as Cycles sees them: rendered into an equirectangular picture.

A copy of the world is rendered around an empty scene of its own; all of it is removed afterwards.
"""

from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager
from math import pi
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
import numpy as np

from ...temporary import CyclesError, Temporary, cycles_scene, frozen_copy
from ..content_key import scene_key, tree_key
from ..materials.nodes import all_nodes, output_node

WIDTH, HEIGHT = 1024, 512
N_SAMPLES = 16
N_SAMPLES_OF_SPOTS = 1 << 20
"""Samples that bright spots get together: suns and lamps are as small as a pixel, and often most of the light."""

MOST_SPOTS = 16

BRIGHT = 50
"""How many times the mean a pixel of a spot has at least."""

LEAST_SUN = 0.02
"""Angle of a Sky Texture's sun that the samples do not miss, rad."""

MARGIN = 4
N_KEPT = 4
_LOOKING_ALONG_X = (pi / 2, 0, -pi / 2)  # the middle of the picture, as in Cycles' Environment Texture
_HANDLERS = ["frame_change_pre", "frame_change_post", "render_init", "render_pre", "render_post", "render_write"]
_HANDLERS += ["render_stats", "render_complete", "render_cancel"]

_rendered: OrderedDict[tuple, np.ndarray] = OrderedDict()


def picture_of_world(world: "bpy.types.World", scene: "bpy.types.Scene") -> np.ndarray:
    """Radiance of a world in all directions, (HEIGHT, WIDTH, 3) float32 as `World.image`; kept for the next time.

    Parameters
    ----------
    world : bpy.types.World
        Original, not evaluated.
    scene : bpy.types.Scene
        Whose frame it is taken at.

    Raises
    ------
    CyclesError
    """
    key = tree_key(world.node_tree), scene_key(world, scene)
    if key not in _rendered:
        _rendered[key] = _render(world, scene)
        while len(_rendered) > N_KEPT:
            _rendered.popitem(last=False)
    _rendered.move_to_end(key)
    return _rendered[key]


def _render(world: "bpy.types.World", scene: "bpy.types.Scene") -> np.ndarray:
    """The picture; bright spots with more samples."""
    with _left_as_it_was() as temporary, TemporaryDirectory() as folder:
        stage = _stage(scene, temporary)
        stage.world = copy = _copy(world, temporary)
        stage.render.filepath = str(Path(folder, "world.exr"))
        # A sun that is too small for the few samples is looked for as a larger one of the same power
        suns = [(node, node.sun_size) for node in all_nodes(copy.node_tree) if node.type == "TEX_SKY" and node.sun_disc]
        for node, size in suns:
            node.sun_size = max(size, LEAST_SUN)
        picture = _shot(stage, N_SAMPLES)
        for node, size in suns:
            node.sun_size = size
        spots = bright_spots(picture)
        for rows, columns in spots:
            render = stage.render
            render.use_border = render.use_crop_to_border = True
            render.border_min_x, render.border_max_x = columns.start / WIDTH, columns.stop / WIDTH
            render.border_min_y, render.border_max_y = rows.start / HEIGHT, rows.stop / HEIGHT
            n_pixels = (rows.stop - rows.start) * (columns.stop - columns.start)
            picture[rows, columns] = _shot(stage, N_SAMPLES_OF_SPOTS // (len(spots) * n_pixels))
    return picture


def bright_spots(picture: np.ndarray) -> list[tuple[slice, slice]]:
    """Rows and columns around groups of pixels much brighter than the mean, those with most light, if they are small.

    Each group is taken together with `MARGIN` pixels around it.
    """
    from scipy import ndimage  # here, as Blender's start should not wait for SciPy

    brightness = np.abs(picture).mean(axis=2)
    bright = brightness > BRIGHT * brightness.mean(dtype=np.float64)
    groups, n = ndimage.label(ndimage.binary_dilation(bright, np.ones((2 * MARGIN + 1,) * 2)))
    light = ndimage.sum_labels(brightness * bright, groups, np.arange(1, n + 1))
    boxes = ndimage.find_objects(groups)
    spots = [boxes[k] for k in np.argsort(-light)[:MOST_SPOTS]]
    most = N_SAMPLES_OF_SPOTS // (2 * N_SAMPLES * max(len(spots), 1))  # pixels that get twice the samples at least
    return [box for box in spots if (box[0].stop - box[0].start) * (box[1].stop - box[1].start) <= most]


def _shot(stage: "bpy.types.Scene", n_samples: int) -> np.ndarray:
    """One render of the scene, (h, w, 3) float32."""
    stage.cycles.samples = n_samples
    with Temporary() as temporary:
        try:
            bpy.ops.render.render(scene=stage.name, write_still=True)
            image = temporary.add(bpy.data.images.load(stage.render.filepath))
        except RuntimeError as error:
            raise CyclesError(str(error).strip()) from error
        width, height = image.size
        pixels = np.empty(width * height * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(height, width, -1)[..., :3]
    return np.nan_to_num(pixels, posinf=0.0, neginf=0.0)


@contextmanager
def _left_as_it_was() -> Iterator[Temporary]:
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


def _copy(world: "bpy.types.World", temporary: Temporary) -> "bpy.types.World":
    """A copy of a world that camera rays see as diffuse rays see the original."""
    copy = frozen_copy(world, {"LIGHT_PATH"}, temporary)
    copy.cycles_visibility.camera = True
    copy.cycles.sampling_method = "NONE"  # saves the map that light would be sampled by
    output = output_node(copy)
    for link in list(output.inputs["Volume"].links) if output else ():
        copy.node_tree.links.remove(link)
    return copy


def _stage(like: "bpy.types.Scene", temporary: Temporary) -> "bpy.types.Scene":
    """A scene with nothing in it but a camera that sees all around."""
    scene = cycles_scene(like, temporary)
    camera = temporary.add(bpy.data.cameras.new("Photon Bake"))
    camera.type = "PANO"
    (camera if hasattr(camera, "panorama_type") else camera.cycles).panorama_type = "EQUIRECTANGULAR"
    scene.camera = temporary.add(bpy.data.objects.new("Photon Bake", camera))
    scene.camera.rotation_euler = _LOOKING_ALONG_X
    scene.collection.objects.link(scene.camera)
    render, cycles = scene.render, scene.cycles
    render.resolution_x, render.resolution_y, render.resolution_percentage = WIDTH, HEIGHT, 100
    render.use_compositing = render.use_sequencer = render.use_file_extension = False
    settings = render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
    cycles.pixel_filter_type, cycles.use_denoising = "BOX", False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    return scene
