"""What the last bake did, in the 3D viewport: cube maps' places, photons, cells of the light volume. Never saved."""

from typing import Any

import bpy

from ...core.inspector import VIEWS, Inspector, View
from ..redraw import redraw_view3d
from .dots import Dots

_STYLES: dict[View, dict[str, Any]] = {
    "maps": {"size": 12.0, "through": True, "colour": (1.0, 0.5, 0.1)},
    "photons": {"size": 2.0},
    "cells": {"size": 5.0},
}


class DebugViews:
    """Which views are shown, and what the last bake of this session left for them.

    Attributes
    ----------
    shown : set of View
    inspector : Inspector
        Of the last bake, or of the one that runs: a view shows it as soon as there is something to see.
    """

    def __init__(self) -> None:
        self.shown: set[View] = set()
        self._draw_handler: Any = None
        self.forget()

    def start(self) -> Inspector:
        """Forget the last bake; the one that begins is to keep what is shown."""
        self.forget()
        self.inspector = Inspector(self.shown)
        return self.inspector

    def forget(self) -> None:
        """Show nothing until the next bake."""
        self.inspector = Inspector()
        self._dots: dict[View, Dots] = {}

    def show(self, view: View, on: bool) -> None:
        """Show a view, or no longer; Blender calls us only while there is a view to show."""
        if on:
            self.shown.add(view)
        else:
            self.shown.discard(view)
            self._dots.pop(view, None)
        if self.shown and self._draw_handler is None and not bpy.app.background:
            self._draw_handler = bpy.types.SpaceView3D.draw_handler_add(self.draw, (), "WINDOW", "POST_VIEW")
        elif not self.shown and self._draw_handler is not None:
            bpy.types.SpaceView3D.draw_handler_remove(self._draw_handler, "WINDOW")
            self._draw_handler = None
        redraw_view3d(bpy.context, "WINDOW")

    def draw(self) -> None:
        """Draw what is shown, as far as there is something."""
        for view in VIEWS:
            if view in self.shown and view in self.inspector.seen:
                if view not in self._dots:
                    self._dots[view] = Dots(self.inspector.seen[view], **_STYLES[view])
                self._dots[view].draw()


debug_views = DebugViews()
"""One bake runs at a time in a Blender, so there is one."""


def _toggle(view: View, name: str, description: str) -> Any:
    def is_shown(_: Any) -> bool:
        return view in debug_views.shown

    def show(_: Any, on: bool) -> None:
        debug_views.show(view, on)

    return bpy.props.BoolProperty(name=name, description=description, get=is_shown, set=show, options={"SKIP_SAVE"})


class PhotonBakeViews(bpy.types.PropertyGroup):
    """What ``window_manager.photon_bake_views`` holds: a toggle for each view."""

    __annotations__ = {
        "maps": _toggle("maps", "Cube Maps", "Where the cube maps of Multi-Image stand"),
        "photons": _toggle("photons", "Photons", "Where photons came to surfaces, in the color of their power"),
        "cells": _toggle(
            "cells", "Volume Cells", "Cells of the light volume near surfaces, in the color of their light"
        ),
    }


@bpy.app.handlers.persistent
def _on_load(*_: Any) -> None:
    debug_views.forget()


def register() -> None:
    """Give the window manager the toggles; another file makes the views forget."""
    bpy.utils.register_class(PhotonBakeViews)
    bpy.types.WindowManager.photon_bake_views = bpy.props.PointerProperty(type=PhotonBakeViews)
    bpy.app.handlers.load_pre.append(_on_load)


def unregister() -> None:
    """Take them away again, with all that is shown."""
    for view in VIEWS:
        debug_views.show(view, False)
    debug_views.forget()
    bpy.app.handlers.load_pre.remove(_on_load)
    del bpy.types.WindowManager.photon_bake_views
    bpy.utils.unregister_class(PhotonBakeViews)
