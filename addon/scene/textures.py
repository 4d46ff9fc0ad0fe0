"""Images that surfaces are textured with."""

from dataclasses import dataclass

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
