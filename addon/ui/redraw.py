"""Asking Blender to draw its 3D views again."""

from typing import Any


def redraw_view3d(context: Any, region_type: str) -> None:
    """Draw again the regions of a type ('WINDOW' is the view, 'UI' its sidebar) of all 3D views."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == region_type:
                        region.tag_redraw()
