"""Work spread over threads, with results in order."""

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

A = TypeVar("A")
B = TypeVar("B")


def ordered_map(function: Callable[[A], B], items: Iterable[A], n_threads: int = 0) -> Iterator[B]:
    """Yield ``function(item)`` for each item, in the items' order, computed on several threads.

    At most two items a thread are in flight, so memory stays bounded however many items there are, and what is made of
    the results does not depend on the number of threads. When the caller stops early (an exception, a cancelled bake),
    items that have not started are dropped.

    Parameters
    ----------
    n_threads : int
        0 takes every core.
    """
    n_threads = n_threads or os.cpu_count() or 1
    pending: deque[Future[B]] = deque()
    with ThreadPoolExecutor(n_threads) as pool:
        try:
            for item in items:
                pending.append(pool.submit(function, item))
                if len(pending) >= 2 * n_threads:
                    yield pending.popleft().result()
            while pending:
                yield pending.popleft().result()
        finally:
            for future in pending:
                future.cancel()


def slices(n: int, size: int) -> Iterator[slice]:
    """Slices of at most `size` that cover ``range(n)``."""
    return (slice(start, min(start + size, n)) for start in range(0, n, size))
