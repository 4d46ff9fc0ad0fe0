"""How the last bake ended, and what it wants known."""

from typing import Any

from ...errors import kind_of
from ..state import bake_state
from .tab import draw_sentence


def draw_outcome(layout: Any, width: int) -> None:
    """Lines of `width` characters: an error or a result, then warnings."""
    column = layout.column(align=True)
    if bake_state.error:
        draw_sentence(column, bake_state.error, "ERROR", width)
    if bake_state.result:
        draw_sentence(column, bake_state.result, "CHECKMARK", width)
    missing = [warning for warning in bake_state.warnings if kind_of(warning) == "missing"]
    if missing:
        _draw_missing(layout, missing, width)
        column = layout.column(align=True)
    for warning in bake_state.warnings:
        if kind_of(warning) != "missing":
            draw_sentence(column, warning, "INFO", width)


def _draw_missing(layout: Any, sentences: list[str], width: int) -> None:
    """One line that opens to a list."""
    header, body = layout.panel("photon_bake_missing", default_closed=True)
    n = len(sentences)
    header.label(text="1 file is missing" if n == 1 else f"{n} files are missing", icon="LIBRARY_DATA_BROKEN")
    if body is not None:
        column = body.column(align=True)
        for sentence in sentences:
            draw_sentence(column, sentence, "DOT", width)
