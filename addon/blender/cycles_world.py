"""Worlds as Cycles sees them: rendered into an equirectangular picture.

A copy of the world is rendered around an empty scene of its own; all of it is removed afterwards.
"""

from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager
from math import pi
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import bpy
import numpy as np

from .content_key import tree_key
from .expressions import constant
from .nodes import Place, output_node

WIDTH, HEIGHT = 1024, 512
N_SAMPLES = 4
N_SAMPLES_OF_SPOT = 1 << 19
"""Samples that the brightest spot gets in all: a sun is as small as a pixel, and often most of the light."""

BRIGHT = 50
"""How many times the mean a pixel of that spot has at least."""

LEAST_SUN = 0.02
"""Angle of a Sky Texture's sun that four samples a pixel do not miss, rad."""

MARGIN = 4
N_KEPT = 4
_LOOKING_ALONG_X = (pi / 2, 0, -pi / 2)  # the middle of the picture, as in Cycles' Environment Texture
_HANDLERS = ["frame_change_pre", "frame_change_post", "render_init", "render_pre", "render_post", "render_write"]
_HANDLERS += ["render_stats", "render_complete", "render_cancel"]

_rendered: OrderedDict[tuple, np.ndarray] = OrderedDict()


class WorldRenderError(Exception):
    """Cycles could not render the world; says why."""


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
    WorldRenderError
    """
    frame = (scene.frame_current, scene.frame_subframe) if _moves(world) else ()
    key = (tree_key(world.node_tree), *frame)
    if key not in _rendered:
        _rendered[key] = _render(world, scene)
        while len(_rendered) > N_KEPT:
            _rendered.popitem(last=False)
    _rendered.move_to_end(key)
    return _rendered[key]


def _nodes(tree: "bpy.types.NodeTree") -> "Iterator[bpy.types.Node]":
    """The nodes of a tree and of the groups in it."""
    for node in tree.nodes:
        yield node
        if node.type == "GROUP" and node.node_tree:
            yield from _nodes(node.node_tree)


def _moves(world: "bpy.types.World") -> bool:
    """Whether a world may look different at another frame."""
    nodes = list(_nodes(world.node_tree))
    images = [node.image for node in nodes if getattr(node, "image", None)]
    blocks = [world, world.node_tree, *(node.node_tree for node in nodes if node.type == "GROUP" and node.node_tree)]
    sources = {image.source for image in images}
    return bool(sources & {"SEQUENCE", "MOVIE"}) or any(block.animation_data is not None for block in blocks)


def _render(world: "bpy.types.World", scene: "bpy.types.Scene") -> np.ndarray:
    """The picture; the brightest spot with more samples."""
    if not hasattr(bpy.types.Scene, "cycles"):
        raise WorldRenderError("Cycles is not enabled")
    with _left_as_it_was() as temporary, TemporaryDirectory() as folder:
        copy = _copy(world, temporary)
        stage = _stage(copy, scene, temporary)
        stage.render.filepath = str(Path(folder, "world.exr"))
        # A sun that is too small for the few samples is looked for as a larger one of the same power
        suns = [(node, node.sun_size) for node in _nodes(copy.node_tree) if node.type == "TEX_SKY" and node.sun_disc]
        for node, size in suns:
            node.sun_size = max(size, LEAST_SUN)
        picture = _shot(stage, N_SAMPLES)
        for node, size in suns:
            node.sun_size = size
        box = brightest_spot(picture)
        if box is not None:
            (top, bottom), (left, right) = box
            render = stage.render
            render.use_border = render.use_crop_to_border = True
            render.border_min_x, render.border_max_x = left / WIDTH, right / WIDTH
            render.border_min_y, render.border_max_y = top / HEIGHT, bottom / HEIGHT
            picture[top:bottom, left:right] = _shot(stage, N_SAMPLES_OF_SPOT // ((bottom - top) * (right - left)))
    return picture


def brightest_spot(picture: np.ndarray) -> tuple[tuple[int, int], tuple[int, int]] | None:
    """Rows and columns (first, after the last) around the pixels much brighter than the mean, if they are few."""
    brightness = picture.mean(axis=2)
    bright = np.argwhere(brightness > BRIGHT * brightness.mean(dtype=np.float64))
    if len(bright) == 0:
        return None
    low = np.maximum(bright.min(axis=0) - MARGIN, 0)
    high = np.minimum(bright.max(axis=0) + 1 + MARGIN, brightness.shape)
    if (high - low).prod() > N_SAMPLES_OF_SPOT // (2 * N_SAMPLES):
        return None
    return (int(low[0]), int(high[0])), (int(low[1]), int(high[1]))


def _shot(stage: "bpy.types.Scene", n_samples: int) -> np.ndarray:
    """One render of the scene, (h, w, 3) float32."""
    stage.cycles.samples = n_samples
    try:
        bpy.ops.render.render(scene=stage.name, write_still=True)
        image = bpy.data.images.load(stage.render.filepath)
    except RuntimeError as error:
        raise WorldRenderError(str(error).strip()) from error
    try:
        width, height = image.size
        pixels = np.empty(width * height * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
    finally:
        bpy.data.images.remove(image)
    pixels = pixels.reshape(height, width, -1)[..., :3]
    return np.maximum(np.nan_to_num(pixels, posinf=0.0, neginf=0.0), 0)


@contextmanager
def _left_as_it_was() -> Iterator[list[Any]]:
    """A list for data-blocks that are removed at the end, the last first; nobody else is told of the renders."""
    handlers = {name: list(getattr(bpy.app.handlers, name)) for name in _HANDLERS}
    results = {image.name for image in bpy.data.images if image.type == "RENDER_RESULT"}
    temporary: list[Any] = []
    try:
        for name in _HANDLERS:
            getattr(bpy.app.handlers, name).clear()
        yield temporary
    finally:
        for name, functions in handlers.items():
            getattr(bpy.app.handlers, name).extend(functions)
        new = [image for image in bpy.data.images if image.type == "RENDER_RESULT" and image.name not in results]
        bpy.data.batch_remove([*temporary[::-1], *new])


def _copy(world: "bpy.types.World", temporary: list[Any]) -> "bpy.types.World":
    """A copy of a world that camera rays see as diffuse rays see the original."""
    copy = world.copy()
    temporary.append(copy)
    copy.cycles_visibility.camera = True
    copy.cycles.sampling_method = "NONE"  # saves the map that light would be sampled by
    _freeze(copy.node_tree, (), temporary)
    output = output_node(copy)
    for link in list(output.inputs["Volume"].links) if output else ():
        copy.node_tree.links.remove(link)
    return copy


def _freeze(tree: "bpy.types.NodeTree", groups: tuple, temporary: list[Any]) -> None:
    """Give a tree groups of its own, and put constants where it asks what kind of ray looks."""
    for node in list(tree.nodes):
        if node.type == "GROUP" and node.node_tree:
            node.node_tree = node.node_tree.copy()
            temporary.append(node.node_tree)
            _freeze(node.node_tree, (*groups, node), temporary)
        elif node.type == "LIGHT_PATH":
            for output in node.outputs:
                fixed = constant(Place(output, groups))
                if fixed is None:
                    continue
                for link in list(output.links):
                    value = tree.nodes.new("ShaderNodeValue").outputs[0]
                    value.default_value = float(fixed[0])
                    tree.links.new(value, link.to_socket)


def _stage(world: "bpy.types.World", like: "bpy.types.Scene", temporary: list[Any]) -> "bpy.types.Scene":
    """A scene with nothing in it but a camera that sees all around."""
    scene = bpy.data.scenes.new("Photon Bake")
    temporary.append(scene)
    camera = bpy.data.cameras.new("Photon Bake")
    temporary.append(camera)
    camera.type = "PANO"
    (camera if hasattr(camera, "panorama_type") else camera.cycles).panorama_type = "EQUIRECTANGULAR"
    scene.camera = bpy.data.objects.new("Photon Bake", camera)
    temporary.append(scene.camera)
    scene.camera.rotation_euler = _LOOKING_ALONG_X
    scene.collection.objects.link(scene.camera)
    scene.world = world
    scene.frame_current, scene.frame_subframe = like.frame_current, like.frame_subframe
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y, render.resolution_percentage = WIDTH, HEIGHT, 100
    render.threads_mode, render.threads = like.render.threads_mode, like.render.threads
    render.use_compositing = render.use_sequencer = render.use_file_extension = False
    settings = render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
    cycles.device, cycles.pixel_filter_type = "CPU", "BOX"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    return scene
