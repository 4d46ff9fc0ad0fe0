"""The threads that do live light's work, which can be halted between two chunks of it."""

import os
from collections.abc import Callable
from dataclasses import dataclass, field

from ...core.parallel import ordered_map, slices


class Halted(Exception):  # noqa: N818 (a wish, not an error)
    """Something more urgent is to be done."""


@dataclass
class Halt:
    """A wish to stop, said by one thread and heeded by those that work."""

    asked: bool = False

    def check(self) -> None:
        """Raise `Halted` if it was asked for."""
        if self.asked:
            raise Halted


@dataclass
class Task:
    """Work on n rows of which the first may be done already: what was halted goes on from there."""

    n: int
    done: int = 0

    @property
    def finished(self) -> bool:
        return self.done >= self.n


@dataclass(frozen=True)
class Crew:
    """Threads and what halts them.

    Attributes
    ----------
    n_threads : int
        0 takes all cores but one.
    halt : Halt
    """

    n_threads: int = 0
    halt: Halt = field(default_factory=Halt)

    def run(self, task: Task, size: int, work: Callable[[slice], object]) -> None:
        """Call `work` with chunks of at most `size` of the rows that are left.

        Raises
        ------
        Halted
            Between two chunks; the task knows what was done.
        """
        n_threads = self.n_threads or max(1, (os.cpu_count() or 1) - 1)
        chunks = [slice(task.done + part.start, task.done + part.stop) for part in slices(task.n - task.done, size)]
        for start in range(0, len(chunks), n_threads):
            self.halt.check()
            some = chunks[start : start + n_threads]
            if n_threads == 1 or len(some) == 1:
                for chunk in some:
                    work(chunk)
            else:
                for _ in ordered_map(work, some, n_threads):
                    pass
            task.done = some[-1].stop
