"""Random numbers that depend on the seed and on what they are for, never on which thread asks first."""

import numpy as np


def stream(seed: int, *key: int) -> np.random.Generator:
    """An independent random stream for each `key` (a stage, a chunk) of a seed."""
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence([seed, *key])))


class PathNumbers:
    """Random numbers of paths: a path always gets the same, whatever became of the others (frame coherence).

    SplitMix64 (Steele, Lea and Flood 2014), whose i-th number can be had without those before: Stafford's mixer
    "Mix13" of key + i γ. The paths' numbers lie 2¹⁶ apart.

    Parameters
    ----------
    seed, key : int
        As for `stream`.
    """

    def __init__(self, seed: int, *key: int) -> None:
        self._start = np.random.SeedSequence([seed, *key]).generate_state(1, np.uint64)
        self._path, self._n_drawn = np.zeros(0, np.uint64), 0

    def of(self, path: np.ndarray) -> "PathNumbers":
        """The same numbers; what is drawn next is for these paths, (n,) int."""
        self._path = path.astype(np.uint64) << np.uint64(16)
        return self

    def random(self, size: tuple[int, ...] | int, dtype: type = np.float32) -> np.ndarray:
        """New numbers in [0, 1) for the paths: (n,) or (n, k), of which each path takes the next k ≤ 4."""
        shape = (size,) if isinstance(size, int) else size
        columns = []
        for _ in range(-(-(shape[1] if len(shape) > 1 else 1) // 2)):
            bits = _mixed(self._start + (self._path + np.uint64(self._n_drawn)) * _GAMMA)
            columns += [bits >> np.uint64(40), (bits >> np.uint64(8)) & np.uint64(0xFFFFFF)]
            self._n_drawn += 1
        numbers = np.stack(columns, axis=1).astype(dtype) * dtype(2**-24)
        return numbers[:, 0] if len(shape) == 1 else numbers[:, : shape[1]]


_GAMMA = np.uint64(0x9E3779B97F4A7C15)
_MIX13 = ((np.uint64(30), np.uint64(0xBF58476D1CE4E5B9)), (np.uint64(27), np.uint64(0x94D049BB133111EB)))


def _mixed(bits: np.ndarray) -> np.ndarray:
    for shift, factor in _MIX13:
        bits = (bits ^ (bits >> shift)) * factor
    return bits ^ (bits >> np.uint64(31))
