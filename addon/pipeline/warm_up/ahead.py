"""The process that compiles kernels, as Blender's own process sees it."""

import os
import platform
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from threading import Lock
from time import perf_counter, sleep

from ...core import compiling
from ...core.progress import Progress

COMPILING = "Compiling kernels (first use)"
_SCRIPT = Path(__file__).with_name("process.py")
_PLACE = Path(__file__).parents[3]
"""The extension's folder by the path that it is imported from, links and all: Numba keeps kernels by that path."""

_LOOK = 0.05
"""Seconds between two looks at the process."""


class Compiler:
    """Fills the folder of kernels once for each version, machine and Python, in a process of its own."""

    def __init__(self) -> None:
        self._waited = 0.0
        self._lock, self._tried = Lock(), False
        self._process: subprocess.Popen[bytes] | None = None
        self._log: Path | None = None

    def start(self) -> None:
        """Begin, unless all kernels are there or it was tried before: a bake compiles by itself what is missing."""
        with self._lock:
            if self._tried or not compiling.jit() or not sys.executable:
                return
            self._tried, self._log = True, _log()
            if self._log is not None and not self._said("all"):
                with suppress(OSError):
                    self._process = _begun(self._log)

    def wait(self, progress: Progress) -> None:
        """Wait until the kernels that bakes need are there, and begin with them if nobody has.

        Raises
        ------
        Cancelled
            If the bake was cancelled; the process goes on.
        """
        started = perf_counter()
        self.start()
        try:
            while self._fraction() < 1 and self.running:
                progress.update(COMPILING, self._fraction())
                sleep(_LOOK)
        finally:
            if self._process is not None:
                self._waited += perf_counter() - started

    @property
    def running(self) -> bool:
        return self._process is not None and self._process.poll() is None

    @property
    def seconds(self) -> float:
        """That bakes have waited for kernels so far: for the process, and for what was compiled in this one."""
        return self._waited + compiling.seconds_compiled()

    @property
    def complaint(self) -> str:
        """What the process says of a library that it could not import; empty if nothing."""
        return (self._said("complaint") or [""])[-1]

    def stop(self) -> None:
        """End the process if it runs; it goes on from there when it is started again."""
        with self._lock:
            process, self._process, self._tried = self._process, None, False
        if process is not None:
            process.kill()
            process.wait()
            assert process.stdin is not None
            process.stdin.close()

    def _fraction(self) -> float:
        """How far the process is with what bakes need; 1 where that is there."""
        return max((float(share) for share in self._said("done")), default=0.0)

    def _said(self, what: str) -> list[str]:
        try:
            lines = self._log.read_text(encoding="utf-8").splitlines() if self._log else []
        except (OSError, ValueError):
            return []
        return [line.partition(" ")[2] for line in lines if line.startswith(f"{what} ")]


def _log() -> Path | None:
    """The file that says how far this version's kernels are compiled; None where they cannot be kept.

    They are for a Python and for the processor that they were compiled on.
    """
    rooms = [path for path in (compiling.ROOT / "addon").iterdir() if path.name not in ("blender", "ui")]
    sources = [source for room in rooms for source in room.rglob("*.py")]
    folder = compiling.folder_of(compiling.digest_of_all(sources))
    if folder is None:
        return None
    return folder / f"{sys.implementation.cache_tag}-{platform.machine()}-{platform.node()}.txt"


def _begun(log: Path) -> "subprocess.Popen[bytes]":
    """The process, of low priority, which imports from where this one does, and ends with it."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "PYTHONNOUSERSITE": "1"}
    environment["PHOTON_BAKE_KERNELS"] = str(compiling.kept_in())
    low = 0
    if sys.platform == "win32":
        low = subprocess.BELOW_NORMAL_PRIORITY_CLASS | subprocess.CREATE_NO_WINDOW
    with log.open("ab") as said:
        return subprocess.Popen(
            [sys.executable, str(_SCRIPT), compiling.PACKAGE, str(_PLACE)],
            stdin=subprocess.PIPE,  # closed by the end of this process
            stdout=said,
            stderr=subprocess.STDOUT,
            env=environment,
            creationflags=low,
        )
