"""Worlds as Cycles sees them: a copy, rendered into an equirectangular picture around an empty scene."""

from dataclasses import dataclass

import bpy
import numpy as np

from ...temporary import Temporary, frozen_copy
from ..content_key import scene_key, tree_key
from ..materials.nodes import output_node
from ..recent import Recent
from .cycles_stage import left_as_it_was, panorama, shot, stage
from .sky_suns import SkySun, discs_of, suns_of

WIDTH, HEIGHT = 1024, 512
N_SAMPLES = 16
N_SAMPLES_OF_SPOTS = 1 << 20
"""Samples that bright spots get together: suns and lamps are as small as a pixel, and often most of the light."""

MOST_SPOTS = 16

BRIGHT = 50
"""How many times the mean a pixel of a spot has at least."""

MARGIN = 4
N_KEPT = 4
_rendered = Recent(N_KEPT)


@dataclass(frozen=True)
class WorldPicture:
    """A world as Cycles renders it.

    Attributes
    ----------
    image : (HEIGHT, WIDTH, 3) float32, W/(m² sr)
        Radiance in all directions, as `World.image`, without the suns.
    suns : list of SkySun or None
        Of each of the world's `discs_of`; None of one that the image shows.
    """

    image: np.ndarray
    suns: list[SkySun | None]


def picture_of_world(world: "bpy.types.World", scene: "bpy.types.Scene") -> WorldPicture:
    """A world in all directions; kept for the next time.

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


def _render(world: "bpy.types.World", scene: "bpy.types.Scene") -> WorldPicture:
    """The picture; bright spots with more samples."""
    with left_as_it_was() as temporary:
        own = stage(scene, temporary)
        panorama(own, temporary, (WIDTH, HEIGHT))
        own.world = copy = _copy(world, temporary)
        suns = suns_of(own, discs_of(copy), temporary)
        picture = shot(own, N_SAMPLES)
        spots = bright_spots(picture)
        for rows, columns in spots:
            render = own.render
            render.use_border = render.use_crop_to_border = True
            render.border_min_x, render.border_max_x = columns.start / WIDTH, columns.stop / WIDTH
            render.border_min_y, render.border_max_y = rows.start / HEIGHT, rows.stop / HEIGHT
            n_pixels = (rows.stop - rows.start) * (columns.stop - columns.start)
            picture[rows, columns] = shot(own, N_SAMPLES_OF_SPOTS // (len(spots) * n_pixels))
    return WorldPicture(picture, suns)


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
