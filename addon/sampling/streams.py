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
