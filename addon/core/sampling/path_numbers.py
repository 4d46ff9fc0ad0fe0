"""Counter-based random numbers: those of a path by their index, whatever became of other paths (frame coherence).

SplitMix64 (Steele, Lea and Flood 2014), whose i-th number can be had without those before: Stafford's mixer "Mix13" of
key + i γ. The paths' numbers lie 2¹⁶ apart.
"""

import numpy as np

from ..compiling import kernel, kernel_array, part

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


@kernel
def _fill(key, path, first, pairs):
    for k in range(len(path)):
        for i in range(pairs.shape[1]):
            pairs[k, i, 0], pairs[k, i, 1] = two_numbers(key, path[k], first + i)


class PathNumbers:
    """`two_numbers` of many paths, one after the other.

    Parameters
    ----------
    seed, key : int
        As for `path_key`.
    """

    def __init__(self, seed: int, *key: int) -> None:
        self._key, self._path, self._n_drawn = path_key(seed, *key), np.zeros(0, np.uint64), 0

    def of(self, path: np.ndarray) -> "PathNumbers":
        """The same numbers; what is drawn next is for these paths, (n,) int."""
        self._path = kernel_array(path, np.uint64)
        return self

    def random(self, size: tuple[int, ...] | int, dtype: type = np.float32) -> np.ndarray:
        """New numbers in [0, 1) for the paths: (n,) or (n, k), of which each path takes the next k."""
        n_columns = 1 if isinstance(size, int) else size[1]
        pairs = np.empty((len(self._path), -(-n_columns // 2), 2), np.float32)
        _fill(self._key, self._path, self._n_drawn, pairs)
        self._n_drawn += pairs.shape[1]
        return pairs.reshape(len(pairs), 2 * pairs.shape[1])[:, :n_columns].reshape(size).astype(dtype)
