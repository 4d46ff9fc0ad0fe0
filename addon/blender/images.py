"""Blender images as scene-linear pixels."""

from dataclasses import dataclass, field
from hashlib import blake2b

import bpy
import numpy as np

from ..scene import Textures

MAX_SIDE = 1024
"""Longest side of an image in texels; longer ones are reduced by box averaging, which bounds memory to 16 MiB each."""

MISSING = np.array([[[1, 0, 1, 1]]], np.float32)
"""What Cycles shows of an image that cannot be read: opaque magenta, whatever the image's settings."""

N_HELD = 8
"""How many pictures are held in case that another material reads them too."""


@dataclass
class ImageTable:
    """The pictures that materials read, and the textures that are made of them, each held once.

    Light that has bounced off a picture is blurred over a whole hemisphere, so the reduction to `MAX_SIDE` costs no
    visible accuracy.

    Attributes
    ----------
    readable : dict of int to bool
        By the `session_uid` of each image that was asked for: whether its pixels could be read.
    """

    readable: dict[int, bool] = field(default_factory=dict)
    _read: dict[tuple[int, bool], np.ndarray] = field(default_factory=dict)
    _index: dict[tuple[bytes, bool], int] = field(default_factory=dict)
    _textures: list[np.ndarray] = field(default_factory=list)
    _extends: list[bool] = field(default_factory=list)

    def read(self, image: "bpy.types.Image", alpha_is_used: bool) -> np.ndarray:
        """Pixels of an image from the bottom left, (height, width, 4) float32, scene-linear colour and alpha.

        `MISSING` where it cannot be read.

        Parameters
        ----------
        image : bpy.types.Image
        alpha_is_used : bool
            Whether something reads the image node's Alpha; Cycles takes transparent texels for black otherwise.
        """
        key = (image.as_pointer(), alpha_is_used)
        if key not in self._read:
            if len(self._read) >= N_HELD:
                self._read.pop(next(iter(self._read)))
            pixels = _raw_pixels(image)
            self.readable[image.session_uid] = pixels is not None
            self._read[key] = MISSING if pixels is None else _linear_pixels(pixels, image, alpha_is_used)
        return self._read[key]

    def add(self, texture: np.ndarray, extends: bool) -> int:
        """Index among the textures of a (height, width, 3) picture that extends its edges or else repeats."""
        texture = np.ascontiguousarray(texture, np.float32)
        key = (blake2b(texture.data, person=repr(texture.shape[:2]).encode()).digest(), extends)
        if key not in self._index:
            self._index[key] = len(self._textures)
            self._textures.append(texture)
            self._extends.append(extends)
        return self._index[key]

    def textures(self) -> Textures:
        """All textures, packed."""
        return Textures.pack(self._textures, self._extends)


def _linear_pixels(pixels: np.ndarray, image: "bpy.types.Image", alpha_is_used: bool) -> np.ndarray:
    channels = pixels.shape[2]
    color = pixels[..., :3] if channels >= 3 else np.repeat(pixels[..., :1], 3, axis=2)
    has_alpha = channels == 4 and image.alpha_mode != "NONE"
    alpha = pixels[..., 3:] if has_alpha else np.ones_like(pixels[..., :1])
    space = image.colorspace_settings.name
    associated = has_alpha and image.alpha_mode in {"STRAIGHT", "PREMUL"} and space not in _DATA_SPACES
    if associated and image.is_float and alpha_is_used:
        color = color / np.where(alpha > 0, alpha, 1)
    if not image.is_float:
        # Cycles multiplies straight alpha into the encoded bytes; packed channels are independent of each other.
        if associated and not alpha_is_used:
            color = color * alpha
        if space not in _LINEAR_SPACES:
            color = _srgb_to_linear(color)
    linear = np.concatenate([np.maximum(color, 0), alpha], axis=2)
    return np.nan_to_num(_reduce(linear), posinf=0.0)


def _raw_pixels(image: "bpy.types.Image") -> np.ndarray | None:
    """Pixels of an image as Blender holds them, (height, width, channels) float32; None where it has none."""
    was_loaded = image.has_data
    width, height = image.size
    pixels = np.empty(width * height * image.channels, np.float32)
    if not len(pixels) or len(image.pixels) != len(pixels):
        return None
    image.pixels.foreach_get(pixels)
    if image.source == "FILE" and not was_loaded:
        image.buffers_free()  # as it was before: pixels that nothing else shows need no memory
    return pixels.reshape(height, width, image.channels)


_DATA_SPACES = {"Non-Color", "Non-Colour Data", "Raw"}
_LINEAR_SPACES = _DATA_SPACES | {"Linear Rec.709", "Linear", "scene_linear"}


def _srgb_to_linear(encoded: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1, any shape, float32."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4).astype(np.float32)


def _reduce(pixels: np.ndarray) -> np.ndarray:
    """Box average of a (height, width, channels) image down to at most `MAX_SIDE` a side."""
    for axis in (0, 1):
        n = pixels.shape[axis]
        if n <= MAX_SIDE:
            continue
        starts = np.arange(MAX_SIDE) * n // MAX_SIDE
        counts = np.diff(np.append(starts, n)).astype(np.float32)
        shape = [1, 1, 1]
        shape[axis] = MAX_SIDE
        pixels = np.add.reduceat(pixels, starts, axis=axis) / counts.reshape(shape)
    return np.ascontiguousarray(pixels, np.float32)
