"""How the command talks: progress on stderr, and Ctrl-C."""

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter
from typing import Any, TextIO

from ..addon.progress import Progress
from .command_options import COMMAND

EVERY_TTY, EVERY_LOG = 0.1, 10.0
"""Seconds between two lines within one stage: on a terminal, where a line replaces the one before, and in a log."""


def say(sentence: str) -> None:
    """One line on stderr; on stdout there is only what Blender itself says."""
    print(f"{COMMAND}: {sentence}", file=sys.stderr, flush=True)


class ProgressLine:
    """Listens to a `Progress` and shows it: one line that changes on a terminal, a few lines in a log."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._tty = stream.isatty()
        self._stage = ""
        self._shown = 0.0

    def __call__(self, stage: str, fraction: float) -> None:
        now = perf_counter()
        if stage == self._stage and now - self._shown < (EVERY_TTY if self._tty else EVERY_LOG):
            return
        line = f"{COMMAND}: {stage}" + (f" {fraction:.0%}" if fraction > 0 else "")
        self._stream.write(f"\r{line}\033[K" if self._tty else f"{line}\n")
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
