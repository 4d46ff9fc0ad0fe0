"""Cells: receivers that are close together and face the same way."""

import numpy as np

_COORDINATE_BITS = 18
_NORMAL_STEPS = 2  # from 0 to a normal's ±1, rounded: the axes lie in the middle of their steps


def cell_keys(position: np.ndarray, normal: np.ndarray, low: np.ndarray, edge: float) -> np.ndarray:
    """A number for the cell of each receiver, (n,) int64: the same for those of one cube and about one normal.

    Parameters
    ----------
    position, normal : (n, 3) float32
    low : (3,) float32, m
        The cubes' lowest corner.
    edge : float, m
        Of the cubes.
    """
    highest = (1 << _COORDINATE_BITS) - 1
    key = np.zeros(len(position), np.int64)
    for axis in range(3):
        step = np.clip((position[:, axis] - low[axis]) / np.float32(edge), 0, highest)
        key = (key << _COORDINATE_BITS) | step.astype(np.int64)
    for axis in range(3):
        key = key * (2 * _NORMAL_STEPS + 1) + np.rint(normal[:, axis] * _NORMAL_STEPS).astype(np.int64) + _NORMAL_STEPS
    return key


def middles(keys: np.ndarray, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The receiver nearest to the mean position of each cell's, (c,) int; and the cell of each receiver, (n,) int."""
    _, cell = np.unique(keys, return_inverse=True)
    n = np.bincount(cell)
    distance2 = np.zeros(len(keys), np.float32)
    for axis in range(3):
        mean = np.bincount(cell, position[:, axis]) / n
        distance2 += (position[:, axis] - mean[cell]).astype(np.float32) ** 2
    order = np.lexsort((distance2, cell))
    return order[np.cumsum(n) - n], cell
