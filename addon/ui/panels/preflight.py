"""What will become of the next bake: who gets light, who does not and why, and how long it takes."""

from typing import Any

from ..checks import checks, key_of
from ..state import bake_state
from .findings import draw_findings


def draw_preflight(layout: Any, context: Any, width: int) -> None:
    """Draw the last check, and ask for another where there is something new."""
    outcome = bake_state.outcome_of(context.scene.session_uid)
    told = outcome is not None and not outcome.stale and outcome.asked == key_of(context.scene)
    if bake_state.running or told:  # the outcome has it all
        return
    checks.want(context.scene, context.view_layer)
    last = checks.of(context.scene)
    if last is None:
        layout.operator("photon_bake.check", icon="VIEWZOOM")
        return
    column = layout.column(align=True)
    if last.preflight.line:
        row = column.row()
        row.label(text=last.preflight.line, icon="LIGHT")
        row.operator("photon_bake.check", text="", icon="FILE_REFRESH", emboss=False)
    if not last.preflight.blocked:
        column.label(text=last.estimate.line[:1].upper() + last.estimate.line[1:], icon="TIME")
    draw_findings(layout, last.preflight.findings, "check", width)
