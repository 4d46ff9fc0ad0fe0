"""How many times as long as foretold bakes take on this machine: learned from them, and kept for the next session."""

import json
import os
from pathlib import Path

import bpy

from ..settings.bake import Gather

_LEARNED = 0.5
"""How much of the difference the last bake makes good."""

_LEAST, _MOST = 0.1, 20.0

_paces: dict[str, float] = {}


def n_cores() -> int:
    """Cores that a bake may use."""
    return os.cpu_count() or 1


def pace_of(gather: Gather) -> float:
    """Times as long as was foretold; 1 where nothing was learned."""
    if not _paces:
        _paces.update(_read())
    return _paces.get(gather, 1.0)


def learn(gather: Gather, foretold: float, seconds: float) -> None:
    """Take note of a bake that took `seconds` instead of those that were foretold at the pace there was."""
    if foretold <= 0 or seconds <= 0:
        return
    pace = pace_of(gather) * (seconds / foretold) ** _LEARNED
    _paces[gather] = min(max(pace, _LEAST), _MOST)
    _write()


def _file() -> Path | None:
    """Where the paces are kept; None where this is no installed extension."""
    try:
        folder = bpy.utils.extension_path_user(__package__.partition(".addon")[0], create=True)
    except (ValueError, OSError):
        return None
    return Path(folder, "pace.json")


def _read() -> dict[str, float]:
    path = _file()
    try:
        return {str(name): float(pace) for name, pace in json.loads(path.read_text()).items()} if path else {}
    except (OSError, ValueError, AttributeError):
        return {}


def _write() -> None:
    path = _file()
    if path is not None:
        try:
            path.write_text(json.dumps(_paces))
        except OSError:
            return  # the next session begins anew
