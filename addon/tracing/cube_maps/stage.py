"""The stage of a bake that makes cube maps, as its progress tells it."""

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

from ...core.parallel import Workers

A = TypeVar("A")
B = TypeVar("B")

_STAGE = "Taking cube maps"


def each(workers: Workers, function: Callable[[A], B], items: Sequence[A]) -> Iterator[B]:
    """Yield ``function(item)`` for each item, in order, and tell the progress.

    Raises
    ------
    Cancelled
        If the bake was cancelled.
    """
    for done, result in enumerate(workers.map(function, items), 1):
        yield result
        workers.progress.update(_STAGE, done / len(items))
