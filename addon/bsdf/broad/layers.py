"""What layers leave on the average over directions: to what they cover that shines by itself."""

import numpy as np

from ...core.compiling import kernel, kernel_array, part
from ...core.vec3 import ZERO, plus, put, row, times
from . import absorbing, sheen

_N = 64  # cosines


def mean_sheen_albedo(roughness: float) -> np.float32:
    """Albedo of white sheen, averaged over directions by their cosine."""
    out = np.zeros(1, np.float32)
    _mean_sheen_albedo(np.float32(roughness), out)
    return np.float32(out[0])


def mean_tint(tint: np.ndarray, ior: float) -> np.ndarray:
    """Transmittance of an absorbing layer with one of `tint` (h, w, 3) along its normal, averaged likewise."""
    colors = kernel_array(tint.reshape(-1, 3), np.float32)
    out = np.empty_like(colors)
    _mean_tint(colors, np.float32(ior), out)
    return out.reshape(tint.shape)


@part
def _cosine(j):
    """The j-th of _N cosines that are even by their squares, as they are by the cosine's weight."""
    return np.sqrt((np.float32(j) + np.float32(0.5)) / np.float32(_N))


@kernel
def _mean_sheen_albedo(roughness, out):
    for j in range(_N):
        out[0] += sheen.share(roughness, _cosine(j)) / np.float32(_N)


@kernel
def _mean_tint(tint, ior, out):
    for i in range(len(tint)):
        total = ZERO, ZERO, ZERO
        for j in range(_N):
            total = plus(total, absorbing.along_way(row(tint, i), ior, _cosine(j)))
        put(out, i, times(total, np.float32(1 / _N)))
