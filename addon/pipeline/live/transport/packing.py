"""Colours in four bytes: nine bits a channel and a common exponent of two, as textures of radiance have it."""

import numpy as np

from ....core.compiling import part

_TOP, _HALF = np.float32(511), np.float32(0.5)
_LEAST, _MOST, _BIAS = -20, 11, 20
_SCALE = np.exp2(np.arange(_LEAST, _MOST + 1)).astype(np.float32)
_MASK = np.uint32(511)
_9, _18, _27 = np.uint32(9), np.uint32(18), np.uint32(27)


@part
def packed(a):
    """A triple of numbers from 0 to 2048 in 32 bits."""
    largest = max(a[0], max(a[1], a[2]))
    e = 0
    while e < _MOST - _LEAST and _SCALE[e] < largest:
        e += 1
    step = _TOP / _SCALE[e]
    bits = _rounded(a[0] * step) | _rounded(a[1] * step) << _9 | _rounded(a[2] * step) << _18
    return np.uint32(bits | np.uint32(e) << _27)


@part
def _rounded(x):
    return np.uint32(min(max(x, np.float32(0)) + _HALF, _TOP))


@part
def unpacked(bits):
    """The triple again, to a part in a thousand of its largest number."""
    step = _SCALE[np.int64(bits >> _27)] / _TOP
    return (
        np.float32(bits & _MASK) * step,
        np.float32(bits >> _9 & _MASK) * step,
        np.float32(bits >> _18 & _MASK) * step,
    )
