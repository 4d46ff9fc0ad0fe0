"""Lightmap files as Blender's images."""

from collections.abc import Sequence
from pathlib import Path

import bpy

from ...settings.frames import Frames
from ...settings.lightmap import LightmapSettings
from ..paths import from_blend_file

OF = "photon_bake_lightmap"
"""Custom property of the images that are lightmaps: the name of what they are of."""

ENCODING, RANGE = "lightmap_encoding", "lightmap_range"
"""Custom properties of the same images: the file's format, and the largest light of RGBM and RGBD."""

FRAMES = "lightmap_frames"
"""Custom property of those that are sequences: their first frame and their last one."""

_ENCODED = {"rgbm", "rgbd"}


def lightmap_image(name: str) -> "bpy.types.Image | None":
    """The image that is the lightmap of an object or an atlas."""
    return next((image for image in bpy.data.images if image.get(OF) == name), None)


def lightmaps_by_file() -> "dict[str, bpy.types.Image]":
    """The images that are lightmaps, by the names of their files."""
    return {Path(image.filepath).name: image for image in bpy.data.images if OF in image}


def load_lightmaps(
    paths: Sequence[Path], names: Sequence[str], settings: LightmapSettings, frames: Frames | None = None
) -> None:
    """Make images of files, linear; those of earlier bakes are used again, with all that refers to them.

    With frames they are sequences, and the files those of the first one.
    """
    for path, name in zip(paths, names, strict=True):
        _load(path, name, settings, frames)


def play_back(user: "bpy.types.ImageUser", image: "bpy.types.Image") -> None:
    """Let a user of an image show the files of its frames, if it is a sequence, at these frames."""
    if image.source != "SEQUENCE" or FRAMES not in image:
        return
    first, last = image[FRAMES]
    user.frame_start, user.frame_duration, user.frame_offset = first, last - first + 1, first - 1
    user.use_auto_refresh, user.use_cyclic = True, False


def _load(path: Path, name: str, settings: LightmapSettings, frames: Frames | None) -> None:
    encoded = settings.file_format in _ENCODED
    image = lightmap_image(name)
    if image is None:
        image = bpy.data.images.load(str(path), check_existing=False)
        image.name = f"Photon Bake {name}"
        image[OF] = name
    elif image.packed_file is not None:
        image.unpack(method="REMOVE")
    image.source, image.filepath = "SEQUENCE" if frames else "FILE", from_blend_file(path)
    if frames:
        image[FRAMES] = (frames.first, frames.last)
    image.colorspace_settings.name = "Non-Color" if encoded else "Linear Rec.709"
    image.alpha_mode = "CHANNEL_PACKED" if encoded else "NONE"
    image[ENCODING], image[RANGE] = settings.file_format, settings.value_range
    image.reload()
    image.use_fake_user = True  # nothing else may refer to it yet
