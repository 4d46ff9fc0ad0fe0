"""Blender images as scene-linear pixels."""

from dataclasses import dataclass, field
from hashlib import blake2b

import bpy
import numpy as np

from .....scene import Textures
from .texels import StoredImage, linear_to_srgb

MISSING = np.array([[[1, 0, 1, 1]]], np.float32)
"""What Cycles shows of an image that cannot be read: opaque magenta, whatever the image's settings."""

N_HELD = 8
"""How many pictures are held in case that another material reads them too."""


@dataclass
class ImageTable:
    """The pictures that materials read, and the textures that are made of them, each held once.

    Light that has bounced off a picture is blurred over a whole hemisphere, so their reduction to a thousand texels a
    side costs no visible accuracy.

    Attributes
    ----------
    readable : dict of int to bool
        By the `session_uid` of each image that was asked for: whether its pixels could be read.
    """

    readable: dict[int, bool] = field(default_factory=dict)
    _read: dict[tuple[int, bool, str, str], np.ndarray] = field(default_factory=dict)
    _index: dict[tuple[bytes, bool], int] = field(default_factory=dict)
    _textures: list[np.ndarray] = field(default_factory=list)
    _extends: list[bool] = field(default_factory=list)
    _packed: Textures | None = None

    def read(self, image: "bpy.types.Image", alpha_is_used: bool, interpolation: str, extension: str) -> np.ndarray:
        """What a node shows of an image within each texel from the bottom left, as `StoredImage.shown`.

        `MISSING` where it cannot be read.

        Parameters
        ----------
        image : bpy.types.Image
        alpha_is_used : bool
            Whether something reads the image node's Alpha; Cycles takes transparent texels for black otherwise.
        interpolation, extension : str
            The node's.
        """
        key = (image.as_pointer(), alpha_is_used, interpolation, extension)
        if key not in self._read:
            if len(self._read) >= N_HELD:
                self._read.pop(next(iter(self._read)))
            pixels = _raw_pixels(image)
            self.readable[image.session_uid] = pixels is not None
            self._read[key] = MISSING if pixels is None else _shown(pixels, image, *key[1:])
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
        """All textures, packed; the same as long as none was added."""
        if self._packed is None or len(self._packed.offset) != len(self._textures):
            self._packed = Textures.pack(self._textures, self._extends)
        return self._packed

    def forget(self) -> None:
        """Hold no pictures of images any more."""
        self._read.clear()


def is_readable(image: "bpy.types.Image") -> bool:
    """Whether colours of an image are known without Cycles: bytes of spaces other than sRGB are not."""
    return image.is_float or image.colorspace_settings.name in {"sRGB", *_LINEAR_SPACES}


def _shown(
    pixels: np.ndarray, image: "bpy.types.Image", alpha_is_used: bool, interpolation: str, extension: str
) -> np.ndarray:
    """What a node shows of pixels as Blender holds them."""
    stored = _as_cycles_stores(pixels, image, alpha_is_used)
    return np.maximum(stored.shown(interpolation, extension), 0)


def _as_cycles_stores(pixels: np.ndarray, image: "bpy.types.Image", alpha_is_used: bool) -> StoredImage:
    """Pixels (height, width, channels) as Blender holds them, between which Cycles would interpolate."""
    channels = pixels.shape[2]
    pixels = np.nan_to_num(pixels, posinf=0.0)
    color = pixels[..., :3] if channels >= 3 else np.repeat(pixels[..., :1], 3, axis=2)
    has_alpha = channels == 4 and image.alpha_mode != "NONE"
    alpha = pixels[..., 3:] if has_alpha else np.ones_like(pixels[..., :1])
    space = image.colorspace_settings.name
    associated = has_alpha and image.alpha_mode in {"STRAIGHT", "PREMUL"} and space not in _DATA_SPACES
    encoded = space == "sRGB" and (not image.is_float or _is_read_from_file(image))
    if associated and not image.is_float:
        color = color * alpha  # into the encoded bytes; packed channels are independent of each other
    if encoded and image.is_float:
        color = linear_to_srgb(color)
    return StoredImage(np.concatenate([color, alpha], axis=2), encoded, associated and alpha_is_used)


def _is_read_from_file(image: "bpy.types.Image") -> bool:
    """Whether Cycles reads an image's file itself, and then keeps sRGB's curve of 16 bits too."""
    return image.source == "FILE" and image.packed_file is None


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
