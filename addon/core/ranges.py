"""Items that have several parts each, such as runs of rows: all parts in one array."""

import numpy as np


def repeat_ranges(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Items that have `counts` (n,) parts each: of every part its item and its number within it, int64."""
    item = np.repeat(np.arange(len(counts)), counts)
    return item, np.arange(len(item)) - (np.cumsum(counts) - counts)[item]
