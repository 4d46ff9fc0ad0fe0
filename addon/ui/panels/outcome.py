"""How the last bake of the scene ended: what it was worth, where its light is, and what it wants known."""

from pathlib import Path
from typing import Any

from ...core.findings import counted, grouped
from ..outcomes import NOISY, Outcome
from ..remedies import REMEDIES
from ..state import bake_state
from .findings import draw_findings
from .tab import draw_sentence


def draw_outcome(layout: Any, scene: Any, width: int) -> None:
    """Lines of `width` characters; none where the scene was not baked."""
    outcome = bake_state.outcome_of(scene.session_uid)
    if outcome is None or bake_state.running:
        return
    column = layout.column(align=True)
    if outcome.stale:
        row = column.row()
        row.label(text="The scene has changed since", icon="ERROR")
        row.operator("photon_bake.bake_indirect", text="", icon="FILE_REFRESH")
    if outcome.error:
        draw_sentence(column, outcome.error, "ERROR", width)
    body = layout.column(align=True)
    body.active = not outcome.stale
    if outcome.result:
        draw_sentence(body, outcome.result, "CHECKMARK", width)
    _draw_worth(body, outcome, width)
    for place in outcome.places:
        draw_sentence(body, place, "BLANK1", width)
    for folder, names in outcome.folders.items():
        _draw_folder(body, folder, names)
    draw_findings(layout, grouped(outcome.warnings), "outcome", width)


def _draw_worth(column: Any, outcome: Outcome, width: int) -> None:
    """What to do about light that is black, or too noisy."""
    no_light = any(warning.startswith("Nothing in the scene gives light") for warning in outcome.warnings)
    if outcome.black and outcome.result and not no_light and (outcome.places or outcome.files):
        draw_sentence(column, "All black: light has nothing to bounce off.", "ERROR", width)
    elif outcome.noise >= NOISY:
        column.label(text=f"Noise {outcome.noise:.0%}; for less:", icon="INFO")
        row = column.row(align=True)
        for remedy in ("quality", "noise"):
            button = row.operator("photon_bake.remedy", text=REMEDIES[remedy][0])
            button.remedy, button.source = remedy, "outcome"


def _draw_folder(column: Any, folder: Path, names: list[str]) -> None:
    """A folder and how many files are in it, with a button that opens it."""
    row = column.row()
    row.label(text=names[0] if len(names) == 1 else f"{counted(len(names), 'file')} in {folder.name}", icon="FILE")
    row.operator("wm.path_open", text="", icon="FILE_FOLDER", emboss=False).filepath = str(folder)
