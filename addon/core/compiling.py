"""How kernels are compiled, and where they are kept: Numba, on disk, under a digest of all that they are made of.

A `kernel` is what Python calls with whole chunks; a `part` is what kernels call and becomes a part of them. Both are
plain Python functions of scalars, small tuples and arrays; ``NUMBA_DISABLE_JIT=1`` runs them as such. They count no
references (of tuples of many arrays that would cost more than rays), so they allocate nothing: who calls a kernel
brings the arrays that it writes into. There is no fast-math, which would change infinities and NaN.
"""

import hashlib
import os
import re
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
import numpy as np

F = TypeVar("F", bound=Callable[..., Any])

_ROOT = Path(__file__).resolve().parents[2]
_FOLDER = Path(os.environ.get("PHOTON_BAKE_KERNELS") or Path(tempfile.gettempdir()) / "photon_bake_kernels")
_HOW = {"nogil": True, "error_model": "numpy", "_nrt": False}
_IMPORT = re.compile(r"^from (\.+)([\w.]*) import (\([^)]*\)|.*)$", re.MULTILINE)


def part(function: F) -> F:
    """Decorate a function that kernels call: it is inlined into them. Called from compiled Python it crashes."""
    return numba.njit(forceinline=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, **_HOW)(function)


def kernel(function: F) -> F:
    """Decorate a function that Python calls: compiled at its first call, kept on disk, lets other threads run."""
    # Numba looks at the kernel's own file alone to see whether it is stale; the folder's name says the rest
    numba.config.CACHE_DIR = str(_FOLDER / digest_of(Path(function.__code__.co_filename).resolve()))
    return numba.njit(cache=True, no_cfunc_wrapper=True, **_HOW)(function)


def kernel_array(values: np.ndarray, dtype: Any) -> np.ndarray:
    """The same values, contiguous, writable and of a dtype: a copy only where they are not.

    For other arrays a kernel would be compiled anew.
    """
    return np.require(values, dtype, ["C", "W"])


@cache
def digest_of(source: Path) -> str:
    """Of the text of a file of the extension and of all that it imports from the extension, in hexadecimal."""
    texts = sorted(hashlib.sha256(path.read_bytes()).hexdigest() for path in _sources(source))
    return hashlib.sha256("".join([numba.__version__, *texts]).encode()).hexdigest()[:16]


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
        base = source.parents[len(dots) - 1].joinpath(*module.split(".") if module else ())
        candidates = [base.with_suffix(".py"), base / "__init__.py"]
        candidates += [base / f"{name}.py" for name in re.findall(r"\w+", names)]
        files += [path for path in candidates if path.is_file() and path.is_relative_to(_ROOT)]
    return tuple(files)
