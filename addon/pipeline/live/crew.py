"""The threads that do live light's work, which can be halted between two chunks of it."""

import os
from collections.abc import Callable
from dataclasses import dataclass, field

from ...core.errors import Cancelled
from ...core.parallel import Workers, ordered_map, slices
from ...core.progress import Progress


@dataclass
class Halt:
    """A wish to stop, said by one thread and heeded by those that work."""

    asked: bool = False


class _Heeding(Progress):
    """A progress that is cancelled by a halt."""

    def __init__(self, halt: Halt) -> None:
        super().__init__()
        self._halt = halt

    @property
    def cancelled(self) -> bool:
        return self._halt.asked


@dataclass
class Task:
    """Work on n rows of which the first may be done already: what was halted goes on from there."""

    n: int
    done: int = 0


@dataclass(frozen=True)
class Crew:
    """Threads and what halts them.

    Attributes
    ----------
    n_threads : int
        0 takes all cores but one.
    seed : int
    halt : Halt
    """

    n_threads: int = 0
    seed: int = 0
    halt: Halt = field(default_factory=Halt)

    @property
    def _n_threads(self) -> int:
        return self.n_threads or max(1, (os.cpu_count() or 1) - 1)

    @property
    def workers(self) -> Workers:
        """The same threads as a bake's stages take them."""
        return Workers(self.seed, self._n_threads, self.progress)

    @property
    def progress(self) -> Progress:
        """What raises `Cancelled` when a halt is asked for."""
        return _Heeding(self.halt)

    def run(self, task: Task, size: int, work: Callable[[slice], object]) -> None:
        """Call `work` with chunks of at most `size` of the rows that are left.

        Raises
        ------
        Cancelled
            Between two chunks; the task knows what was done.
        """
        n_threads = self._n_threads
        chunks = [slice(task.done + part.start, task.done + part.stop) for part in slices(task.n - task.done, size)]
        for start in range(0, len(chunks), n_threads):
            if self.halt.asked:
                raise Cancelled
            some = chunks[start : start + n_threads]
            for _ in ordered_map(work, some, n_threads) if n_threads > 1 else map(work, some):
                pass
            task.done = some[-1].stop
