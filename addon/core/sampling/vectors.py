"""Many vectors at a time: NumPy's own indexing and reductions are slow along short axes."""

import numpy as np


def rows(values: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """`values[chosen]` along the first axis, for a mask or an index array: NumPy copies whole rows so much faster."""
    return values.take(np.flatnonzero(chosen) if chosen.dtype == bool else chosen, axis=0)


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar products of vectors (n, d), (n,)."""
    total = a[:, 0] * b[:, 0]
    for i in range(1, a.shape[1]):
        total += a[:, i] * b[:, i]
    return total


def largest(a: np.ndarray) -> np.ndarray:
    """Largest component of vectors (n, 3), (n,)."""
    return np.maximum(np.maximum(a[:, 0], a[:, 1]), a[:, 2])
