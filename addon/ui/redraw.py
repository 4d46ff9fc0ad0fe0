"""Asking Blender to draw its 3D views and its panels again."""

from typing import Any


def redraw_view3d(context: Any, region_type: str) -> None:
    """Draw again the regions of a type ('WINDOW' is the view, 'UI' its sidebar) of all 3D views."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == region_type:
                        region.tag_redraw()


def redraw_panels(context: Any) -> None:
    """Draw again what shows a bake: the sidebars of 3D views, and Properties editors."""
    redraw_view3d(context, "UI")
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "PROPERTIES":
                area.tag_redraw()
