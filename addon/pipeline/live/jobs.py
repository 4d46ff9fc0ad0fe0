"""Parts of a step that can be halted and go on from there."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from .crew import Crew, Task

A_CHUNK = 1 << 12
"""Rays of a chunk, between two of which a halt is heeded."""


def _nothing() -> None:
    pass


@dataclass
class Job:
    """Work on rows, and what is to be done when all of them are.

    Attributes
    ----------
    n : int
        Rows.
    n_rays : int
        About what each takes.
    work : callable
        Gets a slice of the rows.
    done : callable
    """

    n: int
    n_rays: int
    work: Callable[[slice], object]
    done: Callable[[], object] = _nothing


def no_job(done: Callable[[], object] = _nothing) -> Job:
    """Nothing to do, but what is done after it."""
    return Job(0, 1, lambda _: None, done)


def of_blocks(
    rows: np.ndarray, size: int, work: Callable[[np.ndarray], object], done: Callable[[], object] = _nothing
) -> Job:
    """Work on some rows, a block of them between two looks for a halt."""

    def blocks(chunk: slice) -> None:
        for k in range(chunk.start, chunk.stop):
            work(rows[k * size : (k + 1) * size])

    return Job(-(-len(rows) // size), A_CHUNK, blocks, done)


@dataclass
class Plan:
    """What is left of a step: what makes each job when its turn comes, the first of which may be half done."""

    jobs: deque[Callable[[], Job]] = field(default_factory=deque)
    _job: Job | None = None
    _task: Task = field(default_factory=lambda: Task(0))

    @property
    def empty(self) -> bool:
        return self._job is None and not self.jobs

    def then(self, job: Callable[[], Job]) -> None:
        """Do a job after all others."""
        self.jobs.append(job)

    def next(self, job: Callable[[], Job]) -> None:
        """Do a job before all others."""
        self.jobs.appendleft(job)

    def drop(self) -> None:
        """Leave all of it."""
        self._job = None
        self.jobs.clear()

    def work(self, crew: Crew) -> None:
        """Do all of it.

        Raises
        ------
        Cancelled
            If a halt was asked for.
        """
        while not self.empty:
            if self._job is None:
                self._job = self.jobs.popleft()()
                self._task = Task(self._job.n)
            job = self._job
            crew.run(self._task, max(1, A_CHUNK // max(job.n_rays, 1)), job.work)
            self._job = None
            job.done()
