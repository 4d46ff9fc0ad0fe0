"""Work spread over threads, with results in order, random numbers of its own, and word of its progress."""

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field, replace
from functools import wraps
from threading import RLock, Thread
from typing import TypeVar

import numpy as np

from .progress import Progress
from .sampling.streams import stream

A = TypeVar("A")
B = TypeVar("B")

_LOOK = 0.05
"""Seconds between two looks at whether a bake was cancelled."""


@dataclass(frozen=True)
class Workers:
    """The threads that do a bake's work. What they make depends on the seed, and not on how many they are.

    Attributes
    ----------
    seed : int
    n_threads : int
        0 takes every core.
    progress : Progress
    memory : int
        Megabytes (10⁶ bytes) that all threads' working arrays may take: of large ones fewer threads work at a time.
    """

    seed: int = 0
    n_threads: int = 0
    progress: Progress = field(default_factory=Progress)
    memory: int = 4000

    def map(self, function: Callable[[A], B], items: Iterable[A], item_bytes: int = 0) -> Iterator[B]:
        """`ordered_map` on these threads, or on fewer, where the work on an item takes about `item_bytes`."""
        return ordered_map(function, items, self._threads_for(item_bytes))

    def _threads_for(self, item_bytes: int) -> int:
        """As many threads as `memory` lets work at a time."""
        n_threads = self.n_threads or os.cpu_count() or 1
        return int(min(n_threads, max(1, self.memory * 10**6 // item_bytes))) if item_bytes else n_threads

    def part(self, start: float, end: float) -> "Workers":
        """The same workers, whose stages are a part of the stages."""
        return replace(self, progress=self.progress.part(start, end))

    def parts(self, n: int) -> "list[Workers]":
        """The same workers n times, whose stages are equal parts of the stages."""
        return [self.part(i / n, (i + 1) / n) if n > 1 else self for i in range(n)]

    def chunks(
        self,
        stage: str,
        n: int,
        size: int,
        function: Callable[[slice, np.random.Generator], B],
        key: tuple[int, ...],
        part: tuple[float, float] = (0.0, 1.0),
        row_bytes: int = 0,
    ) -> Iterator[tuple[slice, B]]:
        """Yield each chunk of ``range(n)`` with ``function(chunk, random)``, in order.

        Parameters
        ----------
        stage : str
            What the progress says.
        size : int
            Of a chunk.
        function : callable
            Gets a random stream of the chunk's own.
        key : tuple of int
            What the random numbers are for.
        part : tuple of float
            The part of the stage that this is.
        row_bytes : int
            About what the work on one of the n takes.

        Raises
        ------
        Cancelled
            If the bake was cancelled.
        """
        start, end = part

        def work(item: tuple[int, slice]) -> tuple[slice, B]:
            index, chunk = item
            return chunk, function(chunk, stream(self.seed, *key, index))

        self.progress.update(stage, start)
        for chunk, result in self.map(work, enumerate(slices(n, size)), size * row_bytes):
            yield chunk, result
            self.progress.update(stage, start + (end - start) * chunk.stop / n)


class Turns:
    """Parts of a stage of which nobody knows how many there will be: each is half of what is left of the stage."""

    def __init__(self, workers: Workers) -> None:
        self._workers, self._done = workers, 0.0

    def next(self) -> Workers:
        """Workers whose stages are the next part."""
        start, self._done = self._done, (1 + self._done) / 2
        return self._workers.part(start, self._done)

    def end(self, stage: str) -> None:
        """Say that the stage is done."""
        self._workers.progress.update(stage, 1.0)


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


def aside(function: Callable[[], B], check: Callable[[], None]) -> B:
    """What a function returns that runs on a thread of its own, while this one looks whether the bake was cancelled.

    Then `check` raises its exception within a tenth of a second, and the thread, of which nothing is wanted any more,
    ends by itself when it looks next. It may touch nothing that others change; `join_cancelled` waits for it.
    """
    result = Future[B]()

    def work() -> None:
        try:
            result.set_result(function())
        except BaseException as error:
            result.set_exception(error)

    thread = Thread(target=work, name="Photon Bake (work)")
    thread.start()
    try:
        while not wait([result], _LOOK).done:
            check()
    except BaseException:
        _cancelled.append(thread)
        raise
    return result.result()


_cancelled: list[Thread] = []
"""Threads of `aside` of which nothing is wanted any more."""


def join_cancelled() -> None:
    """Wait for work of cancelled bakes to end: Blender's data must not be built up or freed beside Python's threads."""
    while _cancelled:
        _cancelled.pop().join()


def once(function: Callable[[], B]) -> Callable[[], B]:
    """Decorate a function whose result threads share: it runs once, where `functools.cache` lets several begin it."""
    lock, results = RLock(), list[B]()

    @wraps(function)
    def shared() -> B:
        with lock:
            if not results:
                results.append(function())
            return results[0]

    return shared


def slices(n: int, size: int) -> Iterator[slice]:
    """Slices of at most `size` that cover ``range(n)``."""
    return (slice(start, min(start + size, n)) for start in range(0, n, size))
