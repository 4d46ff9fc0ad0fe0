"""Worlds as Cycles sees them: a copy, rendered into an equirectangular picture around an empty scene."""

import bpy
import numpy as np

from ...temporary import Temporary, frozen_copy
from ..content_key import scene_key, tree_key
from ..materials.nodes import all_nodes, output_node
from ..recent import Recent
from .cycles_stage import left_as_it_was, panorama, shot, stage

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
_rendered = Recent(N_KEPT)


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
    return _rendered.found(key, lambda: _render(world, scene))


def _render(world: "bpy.types.World", scene: "bpy.types.Scene") -> np.ndarray:
    """The picture; bright spots with more samples."""
    with left_as_it_was() as temporary:
        own = stage(scene, temporary)
        panorama(own, temporary, (WIDTH, HEIGHT))
        own.world = copy = _copy(world, temporary)
        # A sun that is too small for the few samples is looked for as a larger one of the same power
        suns = [(node, node.sun_size) for node in all_nodes(copy.node_tree) if node.type == "TEX_SKY" and node.sun_disc]
        for node, size in suns:
            node.sun_size = max(size, LEAST_SUN)
        picture = shot(own, N_SAMPLES)
        for node, size in suns:
            node.sun_size = size
        spots = bright_spots(picture)
        for rows, columns in spots:
            render = own.render
            render.use_border = render.use_crop_to_border = True
            render.border_min_x, render.border_max_x = columns.start / WIDTH, columns.stop / WIDTH
            render.border_min_y, render.border_max_y = rows.start / HEIGHT, rows.stop / HEIGHT
            n_pixels = (rows.stop - rows.start) * (columns.stop - columns.start)
            picture[rows, columns] = shot(own, N_SAMPLES_OF_SPOTS // (len(spots) * n_pixels))
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


def _copy(world: "bpy.types.World", temporary: Temporary) -> "bpy.types.World":
    """A copy of a world that camera rays see as diffuse rays see the original."""
    copy = frozen_copy(world, {"LIGHT_PATH"}, temporary)
    copy.cycles_visibility.camera = True
    copy.cycles.sampling_method = "NONE"  # saves the map that light would be sampled by
    output = output_node(copy)
    for link in list(output.inputs["Volume"].links) if output else ():
        copy.node_tree.links.remove(link)
    return copy
