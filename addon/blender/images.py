"""Blender images as scene-linear pixels."""

from dataclasses import dataclass, field

import bpy
import numpy as np

from ..errors import BakeError
from ..scene import Textures

MAX_SIDE = 1024
"""Longest side of an image in texels; longer ones are reduced by box averaging, which bounds memory to 12 MiB each."""


@dataclass
class ImageTable:
    """The images that materials read, each read once.

    Light that has bounced off a picture is blurred over a whole hemisphere, so the reduction to `MAX_SIDE` costs no
    visible accuracy.
    """

    _index: dict[tuple[int, bool], int] = field(default_factory=dict)
    _images: list[np.ndarray] = field(default_factory=list)

    def add(self, image: "bpy.types.Image", material_name: str, cut_by_alpha: bool) -> int:
        """Index of an image among the textures.

        Parameters
        ----------
        image : bpy.types.Image
        material_name : str
            Who reads it, for messages.
        cut_by_alpha : bool
            Whether transparent texels count as black, as Cycles reads an image node whose Alpha is not used.

        Raises
        ------
        BakeError
            If its file cannot be read.
        """
        key = (image.as_pointer(), cut_by_alpha)
        if key not in self._index:
            self._images.append(_linear_pixels(image, material_name, cut_by_alpha))
            self._index[key] = len(self._images) - 1
        return self._index[key]

    def mean(self, index: int) -> np.ndarray:
        """Mean colour of an image, (3,) float64."""
        return self._images[index].mean(axis=(0, 1), dtype=np.float64)

    def textures(self) -> Textures:
        """All images, packed."""
        return Textures.pack(self._images)


def _linear_pixels(image: "bpy.types.Image", material_name: str, cut_by_alpha: bool) -> np.ndarray:
    """Pixels of an image from the bottom left, (height, width, 3) float32, scene-linear."""
    was_loaded = image.has_data
    width, height = image.size
    pixels = np.empty(width * height * image.channels, np.float32)
    if not len(pixels) or len(image.pixels) != len(pixels):
        raise BakeError(
            f"Image '{image.name}' of material '{material_name}' cannot be read from "
            f"'{bpy.path.abspath(image.filepath)}': restore the file, or point the image to where it is."
        )
    image.pixels.foreach_get(pixels)
    if image.source == "FILE" and not was_loaded:
        image.buffers_free()  # as it was before: pixels that nothing else shows need no memory
    pixels = pixels.reshape(height, width, image.channels)
    color, alpha = pixels[..., :3], pixels[..., 3:4]
    if image.channels < 3:
        color = np.repeat(pixels[..., :1], 3, axis=2)
    space = image.colorspace_settings.name
    if not image.is_float:
        # Cycles multiplies straight alpha into the encoded bytes; packed channels are independent of each other.
        if cut_by_alpha and alpha.size and image.alpha_mode in {"STRAIGHT", "PREMUL"} and space not in _DATA_SPACES:
            color = color * alpha
        if space not in _LINEAR_SPACES:
            color = _srgb_to_linear(color)
    return np.nan_to_num(_reduce(np.maximum(color, 0)), posinf=0.0)


_DATA_SPACES = {"Non-Color", "Non-Colour Data", "Raw"}
_LINEAR_SPACES = _DATA_SPACES | {"Linear Rec.709", "Linear", "scene_linear"}


def _srgb_to_linear(encoded: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1, any shape, float32."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4).astype(np.float32)


def _reduce(color: np.ndarray) -> np.ndarray:
    """Box average of a (height, width, 3) image down to at most `MAX_SIDE` a side."""
    for axis in (0, 1):
        n = color.shape[axis]
        if n <= MAX_SIDE:
            continue
        starts = np.arange(MAX_SIDE) * n // MAX_SIDE
        counts = np.diff(np.append(starts, n)).astype(np.float32)
        shape = [1, 1, 1]
        shape[axis] = MAX_SIDE
        color = np.add.reduceat(color, starts, axis=axis) / counts.reshape(shape)
    return np.ascontiguousarray(color, np.float32)
