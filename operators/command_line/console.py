"""How the command talks: progress on stderr, and Ctrl-C."""

import signal
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from shutil import get_terminal_size
from time import perf_counter
from typing import Any, TextIO

from ...addon.core.progress import Progress
from ...addon.ui.state import duration, share_done
from .options import COMMAND

EVERY_TTY, EVERY_LOG = 0.1, 10.0
"""Seconds between two lines within one stage: on a terminal, where a line replaces the one before, and in a log."""

BAR = 24
"""Characters of a bar."""


def say(sentence: str) -> None:
    """One line on stderr; on stdout there is only what Blender itself says."""
    print(f"{COMMAND}: {sentence}", file=sys.stderr, flush=True)


class ProgressLine:
    """Listens to a `Progress` and shows it: a bar that grows on a terminal, a few lines in a log.

    Parameters
    ----------
    stream : text stream
    shares : dict of str to float
        How long each stage lasts beside the others.
    n_times : int
        How often the stages are gone through.
    name : str
        Of who speaks, before each line.
    """

    def __init__(self, stream: TextIO, shares: Mapping[str, float], n_times: int = 1, name: str = COMMAND) -> None:
        self._stream, self._shares, self._n_times, self._name = stream, shares, n_times, name
        self._tty = stream.isatty()
        self._done: dict[str, float] = {}
        self._fraction, self._n_done = 0.0, 0
        self._stage = ""
        self._started, self._shown = perf_counter(), 0.0

    def next_time(self) -> None:
        """The stages have been gone through, and begin anew."""
        self._done, self._n_done = {}, self._n_done + 1

    def __call__(self, stage: str, fraction: float) -> None:
        self._done[stage] = fraction
        done = (self._n_done + share_done(self._shares, self._done)) / self._n_times
        self._fraction = min(max(self._fraction, done), 1.0)
        now = perf_counter()
        if stage == self._stage and now - self._shown < (EVERY_TTY if self._tty else EVERY_LOG):
            return
        time = duration(now - self._started)
        if self._tty:
            bar = "#" * round(self._fraction * BAR)
            line = f"{self._name}: [{bar:.<{BAR}}] {self._fraction:4.0%} {stage}, {time}"
            self._stream.write(f"\r{line[: get_terminal_size().columns - 1]}\033[K")
        else:
            self._stream.write(f"{self._name}: {stage} ({self._fraction:.0%}, {time})\n")
        self._stream.flush()
        self._stage, self._shown = stage, now

    def clear(self) -> None:
        """Make room on the terminal for another line."""
        if self._tty and self._stage:
            self._stream.write("\r\033[K")
            self._stream.flush()


@contextmanager
def ctrl_c_cancels(progress: Progress) -> Iterator[None]:
    """The first Ctrl-C cancels the bake, a second one kills the process as usual."""

    def cancel(*_: Any) -> None:
        progress.cancel()
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    before = signal.signal(signal.SIGINT, cancel)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)  # None: a handler of Blender's own
