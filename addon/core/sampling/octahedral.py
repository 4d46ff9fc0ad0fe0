"""Unit vectors in four bytes: the octahedral map of Meyer et al. 2010 ("On Floating-Point Normal Vectors")."""

import numpy as np

_SCALE = np.float32(32767)


def encode_octahedral(vectors: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 3) as (n, 2) int16; the error of a decoded vector is below 7e-5 rad."""
    x, y, z = np.abs(vectors).T
    p = vectors[:, :2] / (x + y + z)[:, None]
    folded = (1 - np.abs(p[:, ::-1])) * np.copysign(np.float32(1), p)
    p = np.where(vectors[:, 2:] < 0, folded, p)
    return np.rint(p * _SCALE).astype(np.int16)


def decode_octahedral(packed: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 3) float32 of `encode_octahedral`."""
    p = packed / _SCALE
    z = 1 - np.abs(p[:, :1]) - np.abs(p[:, 1:])
    unfolded = (1 - np.abs(p[:, ::-1])) * np.copysign(np.float32(1), p)
    vectors = np.concatenate([np.where(z < 0, unfolded, p), z], axis=1).astype(np.float32)
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
