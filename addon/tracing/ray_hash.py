"""Numbers that are drawn from a ray itself, the same whichever thread asks."""

import numpy as np

from ..core.compiling import part

_MIX_1, _MIX_2, _LOW = np.uint64(0x7FEB352D), np.uint64(0x846CA68B), np.uint64(0xFFFFFFFF)
_STEP, _8, _15, _16 = np.uint64(0x9E3779B9), np.uint64(8), np.uint64(15), np.uint64(16)


@part
def hashed(origin, direction, step):
    """A number in [0, 1) of a ray and a step, by the mixing of Wellons' "Hash Function Prospector"."""
    mixed = (np.uint64(step + 1) * _STEP) & _LOW
    for value in origin:
        mixed = _mixed(mixed, value)
    for value in direction:
        mixed = _mixed(mixed, value)
    return np.float32(mixed >> _8) * np.float32(2**-24)


@part
def _mixed(mixed, value):
    """The low 32 bits of a number, mixed with those of a float32."""
    mixed ^= np.uint64(np.float32(value).view(np.uint32))
    mixed = ((mixed ^ (mixed >> _16)) * _MIX_1) & _LOW
    mixed = ((mixed ^ (mixed >> _15)) * _MIX_2) & _LOW
    return mixed ^ (mixed >> _16)
