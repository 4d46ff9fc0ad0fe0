"""Random numbers that depend on the seed and on what they are for, never on which thread asks first."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from scipy.stats import qmc

_BELOW_ONE = np.float32(1 - 2**-24)


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


def sobol(n_dimensions: int, seed: int, *key: int) -> "qmc.Sobol":
    """A scrambled Sobol sequence, each `key` of a seed scrambled on its own."""
    from scipy.stats import qmc  # here: it takes a second to import, which Blender's start should not wait for

    # SciPy takes the generator as `seed` before 1.15 and as `rng` from then on; both accept it by position.
    return qmc.Sobol(n_dimensions, scramble=True, seed=stream(seed, *key))


def sobol_chunks(n_dimensions: int, n: int, size: int, seed: int, *key: int) -> Iterator[np.ndarray]:
    """The first n points of a scrambled Sobol sequence, (≤ size, n_dimensions) float32 in [0, 1) at a time."""
    sequence = sobol(n_dimensions, seed, *key)
    for start in range(0, n, size):
        yield below_one(_balanced(sequence, min(size, n - start)))


def _balanced(sequence: "qmc.Sobol", n: int) -> np.ndarray:
    """Points of a sequence without SciPy's warning that n is no power of two: the whole sequence's n is what counts."""
    if sequence.num_generated == 0 and n & (n - 1):
        size = 1 << n.bit_length()
        return sequence.random(size)[:n]
    return sequence.random(n)


def below_one(u: np.ndarray) -> np.ndarray:
    """Float64 numbers of [0, 1) as float32 of [0, 1): rounding must not reach 1."""
    return np.minimum(u.astype(np.float32), _BELOW_ONE)
