"""Lightmap files as Blender's images."""

from collections.abc import Sequence
from pathlib import Path

import bpy

from ..lightmap_settings import LightmapFormat

OF = "photon_bake_lightmap"
"""Custom property of the images that are lightmaps: the name of what they are of."""

_ENCODED: set[LightmapFormat] = {"rgbm", "rgbd"}


def lightmap_image(name: str) -> "bpy.types.Image | None":
    """The image that is the lightmap of an object or an atlas."""
    return next((image for image in bpy.data.images if image.get(OF) == name), None)


def show_lightmaps(paths: Sequence[Path], names: Sequence[str], file_format: LightmapFormat) -> "list[bpy.types.Image]":
    """Images of files, linear; those of earlier bakes are used again, with all that refers to them."""
    return [_shown(path, name, file_format) for path, name in zip(paths, names, strict=True)]


def _shown(path: Path, name: str, file_format: LightmapFormat) -> "bpy.types.Image":
    image = lightmap_image(name)
    if image is None:
        image = bpy.data.images.load(str(path), check_existing=False)
        image.name = f"Lightmap {name}"
        image[OF] = name
    elif image.packed_file is not None:
        image.unpack(method="REMOVE")
    image.source, image.filepath = "FILE", _from_blend_file(path)
    image.colorspace_settings.name = "Non-Color" if file_format in _ENCODED else "Linear Rec.709"
    image.alpha_mode = "CHANNEL_PACKED" if file_format in _ENCODED else "NONE"
    image.reload()
    image.use_fake_user = True  # nothing else may refer to it yet
    return image


def _from_blend_file(path: Path) -> str:
    """The path as seen from the saved file, if it lies in the same folder or below it."""
    folder = Path(bpy.data.filepath).parent
    return bpy.path.relpath(str(path)) if bpy.data.filepath and path.is_relative_to(folder) else str(path)
