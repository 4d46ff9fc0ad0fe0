"""How bakes ended, each kept with the scene that it was of until another file is opened; never saved."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

NOISY = 0.1
"""Relative noise from which on advice comes with it."""


@dataclass
class Outcome:
    """How a bake ended.

    Attributes
    ----------
    result, error : str
        A line about its time and noise, or why it failed.
    warnings : list of str
        What it wants known.
    places : list of str
        Where light went in the .blend file, a line each.
    files : list of Path
        That were written.
    noise : float
        Relative noise of the light; 0 where none is known.
    black : bool
        Whether no point got any light.
    stale : bool
        Whether what it was made of has changed since.
    asked : tuple
        The settings that it was baked with, as `checks.key_of` has them.
    """

    result: str = ""
    error: str = ""
    warnings: list[str] = field(default_factory=list)
    places: list[str] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)
    noise: float = 0.0
    black: bool = False
    stale: bool = False
    asked: tuple[Any, ...] = ()

    @property
    def folders(self) -> dict[Path, list[str]]:
        """Names of the files, by the folders that they are in."""
        found: dict[Path, list[str]] = {}
        for path in self.files:
            found.setdefault(path.parent, []).append(path.name)
        return found
