"""Images that surfaces are textured with, and quantities that may vary over surfaces."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class Textures:
    """Images one after the other in one array of pixels, so that any texel is one look-up.

    Attributes
    ----------
    pixels : (p, 3) float32
        Scene-linear colours, images row by row from the bottom left.
    offset, width, height : (i,) int32
        Where each image starts in `pixels`, and its size.
    extends : (i,) bool
        Whether an image goes on with the texels of its edges outside [0, 1]; otherwise it repeats.
    """

    pixels: np.ndarray
    offset: np.ndarray
    width: np.ndarray
    height: np.ndarray
    extends: np.ndarray

    @staticmethod
    def pack(images: list[np.ndarray], extends: list[bool] | None = None) -> "Textures":
        """Textures of (height, width, 3) images, which all repeat without `extends`."""
        sizes = np.array([image.shape[:2] for image in images], np.int32).reshape(-1, 2)
        offset = np.concatenate([[0], np.cumsum(sizes[:, 0] * sizes[:, 1])])[:-1].astype(np.int32)
        pixels = [image.reshape(-1, 3).astype(np.float32) for image in images] or [np.zeros((0, 3), np.float32)]
        extends = [False] * len(images) if extends is None else extends
        return Textures(np.concatenate(pixels), offset, sizes[:, 1], sizes[:, 0], np.array(extends, bool))


@dataclass(frozen=True)
class Channel:
    """A quantity of m materials that may vary over their surfaces: value × texture.

    Attributes
    ----------
    value : (m, 3) float32
        Scalar quantities stand in all three columns.
    texture : (m,) int32
        Image in the materials' `Textures`, or −1.
    """

    value: np.ndarray
    texture: np.ndarray

    @staticmethod
    def constant(value: np.ndarray) -> "Channel":
        """An untextured channel of (m, 3) or (m,) values."""
        value = np.asarray(value, np.float32)
        value = np.repeat(value[:, None], 3, axis=1) if value.ndim == 1 else value
        return Channel(value, np.full(len(value), -1, np.int32))

    @cached_property
    def textured(self) -> bool:
        return bool((self.texture >= 0).any())

    @cached_property
    def nonzero(self) -> np.ndarray:
        """Whose value is not black all over, (m,) bool."""
        return (self.value != 0).any(axis=1)

    def where(self, chosen: np.ndarray) -> "Channel":
        """The rows that a mask or an index array chooses."""
        return Channel(self.value[chosen], self.texture[chosen])

    @staticmethod
    def join(parts: "list[Channel]") -> "Channel":
        """The rows of several channels, in order."""
        return Channel(np.concatenate([p.value for p in parts]), np.concatenate([p.texture for p in parts]))
