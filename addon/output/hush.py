"""What libraries print by themselves, kept off the console."""

import ctypes
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from tempfile import TemporaryFile


@contextmanager
def hushed(descriptor: int, drops: Callable[[bytes], bool] = lambda line: True) -> Iterator[None]:
    """Drop lines that anything in this process prints inside the block; others are printed when it ends.

    Parameters
    ----------
    descriptor : int
        1 for what goes to stdout, 2 for stderr.
    drops : callable
        Told a line, says whether to drop it; all are dropped without it.

    Notes
    -----
    On Windows nothing is dropped: a Blender with a window has no descriptors there.
    """
    if os.name == "nt":
        yield
        return
    with TemporaryFile() as said:
        _flush()
        console = os.dup(descriptor)
        os.dup2(said.fileno(), descriptor)
        try:
            yield
        finally:
            _flush()
            os.dup2(console, descriptor)
            os.close(console)
            said.seek(0)
            for line in said:
                if not drops(line):
                    os.write(descriptor, line)


def _flush() -> None:
    """Print what Python and C keep in their buffers."""
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            stream.flush()
    ctypes.CDLL(None).fflush(None)
