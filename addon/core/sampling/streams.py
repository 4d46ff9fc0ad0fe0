"""Random numbers that depend on the seed and on what they are for, never on which thread asks first."""

import numpy as np


def stream(seed: int, *key: int) -> np.random.Generator:
    """An independent random stream for each `key` (a stage, a chunk) of a seed."""
    return np.random.Generator(np.random.SFC64(np.random.SeedSequence([seed, *key])))
