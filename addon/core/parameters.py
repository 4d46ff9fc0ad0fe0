"""Knobs: fields of settings that know what they mean and what they may be."""

from collections.abc import Mapping
from dataclasses import Field, dataclass, field, fields
from typing import Any, Literal

from .errors import BakeError

Unit = Literal["", "m", "s", "MB", "px", "texels/m", "%"]
"""What a number counts; of % the number itself is a fraction."""


@dataclass(frozen=True)
class Zero:
    """What 0 means for a number that otherwise says how much.

    Attributes
    ----------
    label : str
        What the panel shows in the place of 0.
    meaning : str
        What is done then, after "0".
    start : float
        What it is set to where it is turned on.
    """

    label: Literal["Off", "Auto"]
    meaning: str
    start: float


def knob(
    default: Any,
    meaning: str,
    low: float | None = None,
    high: float | None = None,
    unit: Unit = "",
    zero: Zero | None = None,
) -> Any:
    """A field with a meaning, and if it is a number with a range, a unit, and what 0 means where that is no amount."""
    limits = {} if low is None else {"low": low, "high": high}
    return field(default=default, metadata={"meaning": meaning, "unit": unit, "zero": zero, **limits})


def meaning_of(knob: "Field[Any]") -> str:
    """A knob's meaning, with that of 0."""
    zero: Zero | None = knob.metadata["zero"]
    return f"{knob.metadata['meaning']}; 0 {zero.meaning}" if zero else str(knob.metadata["meaning"])


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
