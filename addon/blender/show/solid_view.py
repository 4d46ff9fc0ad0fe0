"""3D views whose Solid shading shows color attributes while baked light is shown."""

from collections.abc import Iterator
from typing import Any

import bpy

_BEFORE = "photon_bake_color_types"
"""Custom property of screens: what the color of Solid shading was before, by the numbers of their areas."""


def show_attributes() -> None:
    """Let Solid shading show color attributes in all windows."""
    manager = bpy.context.window_manager
    for screen in {window.screen for window in manager.windows} if manager else set():
        before = {}
        for number, shading in _views(screen):
            if shading.color_type != "VERTEX":
                before[number] = shading.color_type
                shading.color_type = "VERTEX"
        if before and _BEFORE not in screen:
            screen[_BEFORE] = before


def restore_solid_views() -> None:
    """Set Solid shading back to how it was, where nobody has changed it since."""
    for screen in [screen for screen in bpy.data.screens if _BEFORE in screen]:
        before = screen[_BEFORE].to_dict()
        for number, shading in _views(screen):
            if number in before and shading.color_type == "VERTEX":
                shading.color_type = before[number]
        del screen[_BEFORE]


def _views(screen: "bpy.types.Screen") -> Iterator[tuple[str, Any]]:
    for i, area in enumerate(screen.areas):
        for space in area.spaces:
            if space.type == "VIEW_3D":
                yield str(i), space.shading
