"""How kernels are compiled, and where they are kept: Numba, on disk, under a digest of all that they are made of.

A `kernel` is what Python calls with whole chunks; a `part` is what kernels call and becomes a part of them, a `routine`
what they call as a function of its own. All are plain Python functions of scalars, small tuples and arrays;
``NUMBA_DISABLE_JIT=1`` runs them as such. They count no references (of tuples of many arrays that would cost more than
rays), so they allocate nothing: who calls a kernel brings the arrays that it writes into. There is no fast-math, which
would change infinities and NaN.

Numba is imported at the first call, since that takes 0.3 s, for which Blender's start should not wait.
"""

import hashlib
import os
import re
import sys
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import cache, update_wrapper
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from shutil import rmtree
from tempfile import TemporaryFile
from threading import RLock
from time import perf_counter, time
from typing import Any, TypeVar, cast

import numpy as np

F = TypeVar("F", bound=Callable[..., Any])
T = TypeVar("T", bound=type)

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = __name__.partition(".addon.")[0]
"""The name that the extension is imported under."""

KEPT_DAYS = 30
"""For which kernels are kept that nothing uses."""

_HOW = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True, "_nrt": False}
_IMPORT = re.compile(rf"^from (\.+|{re.escape(PACKAGE)}\.)([\w.]*) import (\([^)]*\)|.*)$", re.MULTILINE)
_LOCK = RLock()


def part(function: F) -> F:
    """Decorate a function that kernels call: it is inlined into them. Python cannot call it."""
    return _compiled(function, forceinline=True, no_cpython_wrapper=True)


def routine(function: F) -> F:
    """Decorate a part that is called, and not inlined unless it is short: one that is long, or seldom runs.

    What is inlined in many places is compiled as often. A call costs some nanoseconds.
    """
    return _compiled(function, no_cpython_wrapper=True)


def kernel(function: F) -> F:
    """Decorate a function that Python calls: compiled at its first call, kept on disk, lets other threads run."""
    return _compiled(function, cache=True)


def by_reference(tuple_class: T) -> T:
    """Decorate a named tuple of arrays that only Python makes: kernels and parts take it as one pointer.

    Its members have names in kernels, and no numbers: it can't be unpacked or indexed there.
    """
    if jit():
        with _LOCK:
            _by_reference.append(tuple_class)
            if _numba.cache_info().currsize:
                _register_references()
    return tuple_class


_by_reference: list[type] = []


def _register_references() -> None:
    """Tell Numba of those classes that it does not know yet."""
    from .backend import references

    while _by_reference:
        references.register(_by_reference.pop())


def _compiled(function: F, **how: bool) -> F:
    return cast(F, Compiled(function, how)) if jit() else function


def jit() -> bool:
    """Whether kernels are compiled, and not run as plain Python."""
    return os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0")


class Compiled:
    """A function that Numba compiles, which is made Numba's when it is first needed.

    Attributes
    ----------
    py_func : callable
        The function itself.
    """

    def __init__(self, function: Callable[..., Any], how: dict[str, bool]) -> None:
        self.py_func, self._how = function, how
        self._dispatcher: Any = None
        update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        if "no_cpython_wrapper" in self._how:  # without a wrapper for Python: it would crash
            raise TypeError(f"{self.py_func.__name__} is a part, which only kernels call")
        return (self._dispatcher or self.dispatcher)(*arguments)

    @property
    def dispatcher(self) -> Any:
        """What Numba makes of the function."""
        with _LOCK:
            if self._dispatcher is None:
                self._dispatcher = self._made()
            return self._dispatcher

    @property
    def _numba_type_(self) -> Any:
        """What kernels that call this take it for."""
        return _numba().types.Dispatcher(self.dispatcher)

    def _made(self) -> Any:
        numba, how = _numba(), _HOW | self._how
        if not how.pop("cache", False):
            from .backend.parts import PartCompiler

            return numba.njit(pipeline_class=PartCompiler, **how)(self.py_func)
        # Numba looks at the kernel's own file alone to see whether it is stale; the folder's name says the rest
        folder = folder_of(digest_of(Path(self.py_func.__code__.co_filename).resolve()))
        others, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(folder or "")
        try:
            return numba.njit(cache=folder is not None, **how)(self.py_func)
        finally:
            numba.config.CACHE_DIR = others


@cache
def _numba() -> Any:
    """Numba, which says how long it compiles."""
    import numba
    from numba.core import event

    class Clock(event.Listener):
        """Adds up seconds of compiling; that of parts happens within that of kernels, all under Numba's one lock."""

        def __init__(self) -> None:
            self._depth, self._started = 0, 0.0

        def on_start(self, event: Any) -> None:
            self._started = perf_counter() if self._depth == 0 else self._started
            self._depth += 1

        def on_end(self, event: Any) -> None:
            self._depth -= 1
            if self._depth == 0:
                _seconds.append(perf_counter() - self._started)

    event.register("numba:compile", Clock())
    _register_references()
    return numba


_seconds: list[float] = []


def seconds_compiled() -> float:
    """Seconds that this process has compiled for so far."""
    return sum(_seconds)


def keep_in(folder: Path | None) -> None:
    """Say where kernels are kept from now on; without a folder in the user's cache. PHOTON_BAKE_KERNELS comes first."""
    global _chosen
    _chosen = folder


_chosen: Path | None = None


def kept_in() -> Path | None:
    """The folder that kernels are kept in; None where there is no home to keep them in."""
    named = os.environ.get("PHOTON_BAKE_KERNELS")
    if named or _chosen:
        return Path(named) if named else _chosen
    try:
        home = Path.home()
    except RuntimeError:
        return None
    caches = {"darwin": home / "Library" / "Caches", "win32": home / "AppData" / "Local"}
    cache = os.environ.get("LOCALAPPDATA" if sys.platform == "win32" else "XDG_CACHE_HOME")
    return Path(cache or caches.get(sys.platform, home / ".cache")) / "photon_bake" / "kernels"


@cache
def folder_of(digest: str) -> Path | None:
    """The folder of a digest, which is made and marked as used; None where nothing can be written."""
    top = kept_in()
    if top is None:
        return None
    folder = top / digest
    try:
        if not folder.is_dir():
            folder.mkdir(parents=True, exist_ok=True)
            remove_unused(top)
        TemporaryFile(dir=folder).close()
        os.utime(folder)
    except OSError:
        return None  # compiled anew in each session
    return folder


def remove_unused(top: Path) -> None:
    """Remove folders and marks that nothing has used for `KEPT_DAYS`."""
    for path in top.iterdir():
        with suppress(OSError):
            if time() - path.stat().st_mtime > KEPT_DAYS * 86400:
                rmtree(path, ignore_errors=True) if path.is_dir() else path.unlink()


def kernel_array(values: np.ndarray, dtype: Any) -> np.ndarray:
    """The same values, contiguous, writable and of a dtype: a copy only where they are not.

    For other arrays a kernel would be compiled anew.
    """
    return np.require(values, dtype, ["C", "W"])


@cache
def digest_of(source: Path) -> str:
    """Of the text of a file of the extension and of all that it imports from the extension, in hexadecimal."""
    return digest_of_all(_sources(source))


def digest_of_all(sources: Iterable[Path]) -> str:
    """Of the texts of files, of what compiles them and of Numba's own settings, in hexadecimal."""
    sources = {*sources, *(Path(__file__).with_name("backend")).glob("*.py")}
    texts = sorted(hashlib.sha256(path.read_bytes()).hexdigest() for path in sources)
    settings = sorted(f"{name}={value}" for name, value in os.environ.items() if name.startswith("NUMBA_"))
    # Types that kernels take are known on disk by their full names, in which the package's is
    return hashlib.sha256("\n".join([PACKAGE, *_compilers(), *settings, *texts]).encode()).hexdigest()[:16]


@cache
def _compilers() -> list[str]:
    """Versions of what compiles."""
    found = []
    for name in ("numba", "llvmlite"):
        with suppress(PackageNotFoundError):
            found.append(version(name))
    return found


def _sources(source: Path) -> set[Path]:
    """A file, and what it imports from the extension, and what that imports."""
    found, waiting = set[Path](), [source]
    while waiting:
        path = waiting.pop()
        if path not in found:
            found.add(path)
            waiting += _imported(path)
    return found


@cache
def _imported(source: Path) -> tuple[Path, ...]:
    """Files of the extension that a file imports."""
    files = []
    for dots, module, names in _IMPORT.findall(source.read_text(encoding="utf-8")):
        top = ROOT if dots.strip(".") else source.parents[len(dots) - 1]  # tests import by the package's name
        base = top.joinpath(*module.split(".") if module else ())
        candidates = [base.with_suffix(".py"), base / "__init__.py"]
        candidates += [base / f"{name}.py" for name in re.findall(r"\w+", names)]
        files += [path for path in candidates if path.is_file() and path.is_relative_to(ROOT)]
    return tuple(files)
