"""Where rays are in a box."""

import numpy as np


def through_box(box: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances at which rays (n, 3) enter a box (2, 3), 0 from inside, and leave it, (n,) float32 each, m.

    A ray that passes the box by leaves it before it enters.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        to_low, to_high = (box[0] - origins) / directions, (box[1] - origins) / directions
    enter = np.fmax.reduce(np.fmin(to_low, to_high), axis=1)
    leave = np.fmin.reduce(np.fmax(to_low, to_high), axis=1)
    return np.maximum(enter, 0).astype(np.float32), leave.astype(np.float32)


def widened(box: np.ndarray, share: float) -> np.ndarray:
    """A box (2, 3) with a margin of a share of its diagonal all around, float32."""
    margin = share * np.linalg.norm(box[1] - box[0])
    return (box + np.array([[-margin], [margin]])).astype(np.float32)


def thickened(box: np.ndarray) -> np.ndarray:
    """A box (2, 3) widened where it is flat, to a tenth of its longest side at least, float32."""
    extent = box[1] - box[0]
    margin = np.maximum(max(float(extent.max()), 1e-3) / 10 - extent, 0) / 2
    return np.stack([box[0] - margin, box[1] + margin]).astype(np.float32)
