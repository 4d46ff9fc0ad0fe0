"""Parts of a step that can be halted and go on from there."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from .crew import Crew, Task

_RAYS = 1 << 12
"""Of a chunk, between two of which a halt is heeded."""


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
            crew.run(self._task, max(1, _RAYS // max(job.n_rays, 1)), job.work)
            self._job = None
            job.done()
