"""Arrays on the graphics card, as textures that shaders read row by row."""

from typing import Any

import gpu
import numpy as np

WIDTH = 4096
"""Texels of a table beside each other: row i of an array is at (i % WIDTH, i // WIDTH)."""

_LARGEST = 65504.0
"""Of half floats."""


def table(rows: np.ndarray, half: bool = False) -> Any:
    """A texture of an array (n, up to 4); of half floats for colours."""
    rows = np.asarray(rows, np.float32)
    n = max(len(rows), 1)
    height = -(-n // WIDTH)
    width = WIDTH if height > 1 else n
    texels = np.zeros((height * width, 4), np.float32)
    texels[: len(rows), : rows.shape[1]] = rows
    return image(texels.reshape(height, width, 4), half)


def image(texels: np.ndarray, half: bool = False) -> Any:
    """A texture of (height, width, 4) or (depth, height, width, 4) values, the first at the bottom left."""
    if half:
        texels = np.clip(np.nan_to_num(texels), -_LARGEST, _LARGEST)
    flat = np.ascontiguousarray(texels, np.float32).reshape(-1)
    data = gpu.types.Buffer("FLOAT", len(flat), flat)
    size = texels.shape[-2::-1]
    return gpu.types.GPUTexture(size, format="RGBA16F" if half else "RGBA32F", data=data)
