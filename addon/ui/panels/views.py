"""What of the last bake the viewport shows."""

from typing import Any

import bpy

from ...core.inspector import VIEWS, View
from ..views.debug_views import debug_views
from ..views.texel_view import draw_texel_view
from .tab import Section


class PHOTON_BAKE_PT_debug_views(Section, bpy.types.Panel):
    """What of the last bake the viewport shows."""

    bl_label = "Debug Views"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        column = self.layout.column()
        for view in VIEWS:
            column.prop(context.window_manager.photon_bake_views, view)
            if view in debug_views.shown:
                column.label(text=_what_is_seen(view), icon="BLANK1")
        draw_texel_view(column, context)


def _what_is_seen(view: View) -> str:
    points = debug_views.inspector.seen.get(view)
    if points is None:
        return "Nothing yet: bake to see it"
    n = len(points.position)
    return f"{n:,}" if n == points.n_all else f"{n:,} of {points.n_all:,}"
