"""Sums and maxima over the three components of many vectors: NumPy's own reductions are slow along short axes."""

import numpy as np


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar products of vectors (n, 3), (n,)."""
    return np.einsum("ij,ij->i", a, b)


def largest(a: np.ndarray) -> np.ndarray:
    """Largest component of vectors (n, 3), (n,)."""
    return np.maximum(np.maximum(a[:, 0], a[:, 1]), a[:, 2])
