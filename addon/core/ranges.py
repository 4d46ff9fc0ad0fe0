"""Items that have several parts each, such as runs of rows: all parts in one array."""

from collections.abc import Iterator

import numpy as np

from .parallel import slices


def repeat_ranges(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Items that have `counts` (n,) parts each: of every part its item and its number within it, int64."""
    item = np.repeat(np.arange(len(counts)), counts)
    return item, np.arange(len(item)) - (np.cumsum(counts) - counts)[item]


def repeat_ranges_in_chunks(counts: np.ndarray, size: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The same in chunks of at most `size` parts, for parts that are too many at once."""
    ends = np.cumsum(counts)
    for chunk in slices(int(ends[-1]) if len(ends) else 0, size):
        k = np.arange(chunk.start, chunk.stop)
        item = np.searchsorted(ends, k, side="right")
        yield item, k - (ends[item] - counts[item])
