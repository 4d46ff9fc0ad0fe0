"""Numbers whose 0 means Off or Auto, as the panel shows them: a checkbox, and the number where it counts.

A bake reads the number alone, so that scripts and older files mean what they say. Beside it a file keeps the number
that there was before it was turned off.
"""

from dataclasses import Field
from typing import Any

import bpy

from ...core.parameters import Unit, Zero

SUBTYPES: dict[Unit, dict[str, Any]] = {
    "m": {"subtype": "DISTANCE", "unit": "LENGTH"},
    "s": {"subtype": "TIME_ABSOLUTE", "unit": "TIME_ABSOLUTE"},
    "px": {"subtype": "PIXEL"},
    "%": {"subtype": "FACTOR"},
}
"""What Blender's properties know of a unit; the others stand in the name."""


def switch_of(name: str, zero: Zero) -> str:
    """The name of the checkbox of a number."""
    return f"auto_{name}" if zero.label == "Auto" else f"use_{name}"


def zero_properties(knob: "Field[Any]", kind: type, label: str) -> dict[str, Any]:
    """What a property group has beside a number whose 0 means something else.

    ``auto_NAME`` or ``use_NAME``, the checkbox; ``NAME_shown``, the number as it is shown, in percent where its unit is
    that; ``NAME_last``, the number that it is set to where it is turned on.
    """
    name, zero, unit = knob.name, knob.metadata["zero"], knob.metadata["unit"]
    low, high = knob.metadata["low"], knob.metadata["high"]
    auto, scale = zero.label == "Auto", 100.0 if unit == "%" else 1.0

    def is_ticked(group: Any) -> bool:
        return (getattr(group, name) == 0) == auto

    def tick(group: Any, on: bool) -> None:
        value = getattr(group, name)
        if on != auto and value == 0:
            setattr(group, name, getattr(group, f"{name}_last"))
        elif on == auto and value != 0:
            setattr(group, f"{name}_last", value)
            setattr(group, name, 0)

    def shown(group: Any) -> Any:
        return kind(scale * (getattr(group, name) or getattr(group, f"{name}_last")))

    def show(group: Any, value: Any) -> None:
        setattr(group, name, kind(value / scale) if kind is float else value)

    number = bpy.props.IntProperty if kind is int else bpy.props.FloatProperty
    subtype = {"subtype": "PERCENTAGE", "precision": 1} if unit == "%" else SUBTYPES.get(unit, {})
    least = 1 if kind is int else low
    meaning = f"{zero.label}: 0, which {zero.meaning}" if auto else f"{knob.metadata['meaning']}; off {zero.meaning}"
    return {
        switch_of(name, zero): bpy.props.BoolProperty(
            name=label, description=meaning, get=is_ticked, set=tick, options={"SKIP_SAVE"}
        ),
        f"{name}_shown": number(
            name=label,
            description=knob.metadata["meaning"],
            get=shown,
            set=show,
            min=kind(scale * least),
            max=kind(scale * high),
            options={"SKIP_SAVE"},
            **subtype,
        ),
        f"{name}_last": number(default=kind(zero.start), min=least, max=high, options={"HIDDEN"}),
    }


def draw_zero(column: Any, group: Any, knob: "Field[Any]", label: str) -> None:
    """Draw the checkbox and the number of a knob into a column that is split for properties."""
    zero = knob.metadata["zero"]
    row, auto = column.row(align=True, heading=label), zero.label == "Auto"
    switch = switch_of(knob.name, zero)
    row.prop(group, switch, text="Auto" if auto else "")
    ticked = getattr(group, switch)
    if not (auto and ticked):
        number = row.row(align=True)
        number.active = auto or ticked
        number.prop(group, f"{knob.name}_shown", text="")
