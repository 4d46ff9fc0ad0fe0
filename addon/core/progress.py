"""How a running bake tells how far it is, and is told to stop."""

from collections.abc import Callable
from time import perf_counter

from .errors import Cancelled


class Progress:
    """Reports stages and their fractions to a listener, and raises `Cancelled` when asked to stop.

    `update` is called from the bake's own thread by every loop that can last over 0.2 s, and `check` by those on other
    threads; `cancel` may be called from any thread or signal handler.

    Parameters
    ----------
    listener : callable, optional
        Called as ``listener(stage, fraction)`` with the stage's name and a fraction in [0, 1].
    """

    def __init__(self, listener: Callable[[str, float], None] | None = None) -> None:
        self._listener = listener
        self._cancelled = False
        self._stage = ""
        self._last = 0.0
        self._seconds: dict[str, float] = {}

    def cancel(self) -> None:
        """Ask the bake to stop at its next update."""
        self._cancelled = True

    @property
    def cancelled(self) -> bool:
        return self._cancelled

    def check(self) -> None:
        """Raise `Cancelled` if `cancel` has been called; for any thread."""
        if self.cancelled:
            raise Cancelled

    def update(self, stage: str, fraction: float) -> None:
        """Say that `stage` is done to `fraction`.

        Raises
        ------
        Cancelled
            If `cancel` has been called.
        """
        self.check()
        now = perf_counter()
        if self._stage:
            self._seconds[self._stage] += now - self._last
        self._stage, self._last = stage, now
        self._seconds.setdefault(stage, 0.0)
        if self._listener is not None:
            self._listener(stage, fraction)

    def part(self, start: float, end: float) -> "Progress":
        """A progress whose stages are the part of this one's from `start` to `end`."""
        return _Part(self, start, end)

    def quiet(self) -> "Progress":
        """A progress that tells nobody of its stages, and is cancelled with this one."""
        return _Quiet(self, 0.0, 1.0)

    @property
    def stage_seconds(self) -> dict[str, float]:
        """Seconds from the first update of each stage to the first of the next, in the stages' order."""
        return dict(self._seconds)


class _Part(Progress):
    """Stages that are done several times over, as parts of one."""

    def __init__(self, whole: Progress, start: float, end: float) -> None:
        super().__init__()
        self._whole, self._start, self._end = whole, start, end

    def cancel(self) -> None:
        self._whole.cancel()

    @property
    def cancelled(self) -> bool:
        return self._whole.cancelled

    def update(self, stage: str, fraction: float) -> None:
        self._whole.update(stage, self._start + (self._end - self._start) * fraction)


class _Quiet(_Part):
    """Stages of work that is a part of another stage."""

    def update(self, stage: str, fraction: float) -> None:
        self.check()
