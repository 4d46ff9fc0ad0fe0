"""Knobs: fields of settings that know what they mean and what they may be."""

from collections.abc import Mapping
from dataclasses import field, fields
from typing import Any

from .errors import BakeError


def knob(default: Any, meaning: str, low: float | None = None, high: float | None = None) -> Any:
    """A field with a meaning, and a range if it is a number."""
    limits = {} if low is None else {"low": low, "high": high}
    return field(default=default, metadata={"meaning": meaning, **limits})


def check_knobs(settings: Any, choices: Mapping[str, tuple[str, ...]]) -> None:
    """See that all knobs are what they may be.

    Parameters
    ----------
    settings : dataclass
    choices : dict of str to tuple of str
        The knobs that are one of several names.

    Raises
    ------
    BakeError
        If one is out of its range, naming the knob and the range.
    """
    for name, names in choices.items():
        if getattr(settings, name) not in names:
            raise BakeError(f"{name} is {getattr(settings, name)!r}; choose one of {', '.join(names)}.")
    for one in fields(settings):
        value = getattr(settings, one.name)
        if "low" in one.metadata and not one.metadata["low"] <= value <= one.metadata["high"]:
            low, high = one.metadata["low"], one.metadata["high"]
            raise BakeError(f"{one.name} is {value}; choose a value from {low:g} to {high:g}.")
