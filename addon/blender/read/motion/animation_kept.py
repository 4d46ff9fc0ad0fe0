"""Animated values of the file's data-blocks, put back after Blender evaluated other times.

Evaluating a frame writes what curves and drivers say into the data-blocks that they animate, over what people changed
there and did not key.
"""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import bpy

_UNREADABLE = (ValueError, TypeError, AttributeError, KeyError)
"""What Blender raises for curves whose property is gone, or cannot be set."""


@contextmanager
def animation_kept() -> Iterator[None]:
    """Give all animated properties the values at the end that they have at the beginning."""
    before = [(block, path, _value(block, path)) for block in _animated() for path in sorted(_paths(block))]
    try:
        yield
    finally:
        for block, path, value in before:
            if value is not None and _value(block, path) != value:
                with suppress(*_UNREADABLE):
                    _put(block, path, value)


def _animated() -> "Iterator[bpy.types.ID]":
    """The data-blocks, node trees inside of others with them, that have animation."""
    for block in bpy.data.user_map():
        for one in (block, getattr(block, "node_tree", None)):
            if getattr(one, "animation_data", None) is not None:
                yield one


def _paths(block: "bpy.types.ID") -> set[str]:
    """Paths of the properties that a data-block's curves and drivers animate."""
    data = block.animation_data
    strips = [strip.action for track in data.nla_tracks for strip in track.strips]
    actions = {action for action in (data.action, *strips) if action is not None}
    curves = [
        curve
        for action in actions
        for layer in action.layers
        for strip in layer.strips
        for bag in strip.channelbags
        for curve in bag.fcurves
    ]
    return {curve.data_path for curve in (*curves, *data.drivers)}


def _value(block: "bpy.types.ID", path: str) -> Any:
    """A property's value, arrays as tuples; None where there is no such property."""
    try:
        value = block.path_resolve(path)
        return tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value
    except _UNREADABLE:
        return None


def _put(block: "bpy.types.ID", path: str, value: Any) -> None:
    """Set a property, or a custom property, which the path has in brackets."""
    if path.endswith("]"):
        owner, _, key = path.removesuffix('"]').rpartition('["')
        (block.path_resolve(owner) if owner else block)[key] = value
    else:
        owner, _, name = path.rpartition(".")
        setattr(block.path_resolve(owner) if owner else block, name, value)
