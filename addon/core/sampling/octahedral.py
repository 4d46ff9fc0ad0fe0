"""Unit vectors in four bytes: the octahedral map of Meyer et al. 2010 ("On Floating-Point Normal Vectors")."""

import numpy as np

from ..compiling import kernel, kernel_array, part
from ..vec3 import ONE, ZERO, length, put, row

_SCALE = np.float32(32767)


@part
def octahedral_code(vector):
    """A unit vector as two int16; the error of a decoded vector is below 7e-5 rad."""
    size = abs(vector[0]) + abs(vector[1]) + abs(vector[2])
    p, q = vector[0] / size, vector[1] / size
    if vector[2] < ZERO:
        p, q = _folded(p, q)
    return np.int16(np.rint(p * _SCALE)), np.int16(np.rint(q * _SCALE))


@part
def octahedral_vector(p, q):
    """The unit vector of an `octahedral_code`."""
    p, q = np.float32(p) / _SCALE, np.float32(q) / _SCALE
    z = ONE - abs(p) - abs(q)
    if z < ZERO:
        p, q = _folded(p, q)
    size = length((p, q, z))
    return p / size, q / size, z / size


@part
def _folded(p, q):
    return (ONE - abs(q)) * np.copysign(ONE, p), (ONE - abs(p)) * np.copysign(ONE, q)


@kernel
def _codes(vectors, out):
    for i in range(len(vectors)):
        out[i, 0], out[i, 1] = octahedral_code(row(vectors, i))


@kernel
def _vectors(packed, out):
    for i in range(len(packed)):
        put(out, i, octahedral_vector(packed[i, 0], packed[i, 1]))


def encode_octahedral(vectors: np.ndarray) -> np.ndarray:
    """`octahedral_code` of unit vectors (n, 3), (n, 2) int16."""
    out = np.empty((len(vectors), 2), np.int16)
    _codes(kernel_array(vectors, np.float32), out)
    return out


def decode_octahedral(packed: np.ndarray) -> np.ndarray:
    """`octahedral_vector` of codes (n, 2), (n, 3) float32."""
    out = np.empty((len(packed), 3), np.float32)
    _vectors(kernel_array(packed, np.int16), out)
    return out
