"""How far the bake is, in the status bar of every window."""

from typing import Any

from .state import bake_state


def show_progress(context: Any) -> None:
    """Show it, or show it anew."""
    context.workspace.status_text_set(_draw)


def hide_progress(context: Any) -> None:
    """Leave the status bar to Blender again."""
    context.workspace.status_text_set(None)


def _draw(header: Any, context: Any) -> None:
    layout = header.layout
    if bake_state.running:
        row = layout.row(align=True)
        bar = row.row(align=True)
        bar.ui_units_x = 14
        bar.progress(factor=bake_state.fraction, text=bake_state.words)
        row.operator("photon_bake.cancel", text="", icon="X")
    type(header)._draw_orig(header, context)
