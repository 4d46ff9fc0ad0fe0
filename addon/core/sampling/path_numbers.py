"""Counter-based random numbers inside kernels: those of a path by their index, whatever became of other paths.

The same numbers as `PathNumbers`: SplitMix64 (Steele, Lea and Flood 2014), whose i-th number can be had without those
before, with Stafford's mixer "Mix13". The paths' numbers lie 2¹⁶ apart.
"""

import numpy as np

from ..compiling import part

_GAMMA = np.uint64(0x9E3779B97F4A7C15)
_MIX_1, _MIX_2 = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_8, _16, _27, _30, _31, _40 = (np.uint64(n) for n in (8, 16, 27, 30, 31, 40))
_LOW = np.uint64(0xFFFFFF)
_STEP = np.float32(2**-24)


def path_key(seed: int, *key: int) -> np.uint64:
    """What `two_numbers` takes for a stage (`key`) of a seed."""
    return np.random.SeedSequence([seed, *key]).generate_state(1, np.uint64)[0]


@part
def two_numbers(key, path, i):
    """The i-th pair of numbers in [0, 1) of a path; i below 2¹⁶."""
    bits = key + ((np.uint64(path) << _16) + np.uint64(i)) * _GAMMA
    bits = (bits ^ (bits >> _30)) * _MIX_1
    bits = (bits ^ (bits >> _27)) * _MIX_2
    bits ^= bits >> _31
    return np.float32(bits >> _40) * _STEP, np.float32((bits >> _8) & _LOW) * _STEP
