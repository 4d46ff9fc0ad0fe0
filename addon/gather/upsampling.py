"""Light found in few pixels and interpolated to all: joint bilateral upsampling (McGuire and Luebke, section 5.2).

A pixel takes the four pixels of a coarse grid around it, by bilinear weights, and by how much they lie on its own
surface. One that resembles none of them is lit for itself, so that neither edges nor thin things are blurred.
"""

from collections.abc import Callable

import numpy as np

from ..receivers import Camera, SeenSurface
from ..sampling.vectors import dot

_LEAST_WEIGHT = np.float32(0.05)  # of all four, below which they tell nothing of a pixel
_SHARPNESS = 8  # power of the cosine between normals: a half at 24°

Light = Callable[[SeenSurface], np.ndarray]
"""What is to be found: values (n, c) float32 at points that are seen."""


def upsampled(camera: Camera, seen: SeenSurface, step: int, light: Light) -> np.ndarray:
    """`light` (p, c) float32 at what a camera sees, found in one of `step`² pixels and where those do not suffice."""
    if step == 1 or len(seen) == 0:
        return light(seen)
    coarse = np.flatnonzero(_on_grid(camera, seen.pixel, step))
    values, weight = _interpolated(camera, seen, step, coarse, light(seen.where(coarse)))
    alone = np.flatnonzero(weight < _LEAST_WEIGHT)
    if len(alone):
        values[alone] = light(seen.where(alone))
    return values


def _on_grid(camera: Camera, pixel: np.ndarray, step: int) -> np.ndarray:
    """Which pixels are of the coarse grid, (n,) bool: every `step`-th of every `step`-th row."""
    row, column = np.divmod(pixel, camera.width)
    return (row % step == 0) & (column % step == 0)


def _interpolated(
    camera: Camera, seen: SeenSurface, step: int, coarse: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Weighted means (p, c) of the coarse values (k, c) around each point, and the sums of their weights (p,)."""
    n_rows, n_columns = -(-camera.height // step), -(-camera.width // step)
    grid = np.full((n_rows, n_columns), -1)
    row, column = np.divmod(seen.pixel, camera.width)
    grid[row[coarse] // step, column[coarse] // step] = np.arange(len(coarse))
    reach = step * np.sqrt(seen.area)
    sums, weights = np.zeros((len(seen), values.shape[1])), np.zeros(len(seen))
    for down in (0, 1):
        for right in (0, 1):
            i, j = row // step + down, column // step + right
            k = grid[np.minimum(i, n_rows - 1), np.minimum(j, n_columns - 1)]
            near = (1 - np.abs(row / step - i)) * (1 - np.abs(column / step - j))
            alike = np.maximum(dot(seen.normal[coarse[k]], seen.normal), 0) ** _SHARPNESS
            off_plane = np.abs(dot(seen.position[coarse[k]] - seen.position, seen.normal))
            weight = np.where(k >= 0, near * alike * np.maximum(1 - off_plane / reach, 0), 0)
            sums += weight[:, None] * values[k]
            weights += weight
    return (sums / np.maximum(weights, 1e-30)[:, None]).astype(np.float32), weights
