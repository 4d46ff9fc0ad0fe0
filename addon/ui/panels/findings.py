"""Findings, a line each that opens to sentences and buttons: what a check found, or what a bake warned of."""

from collections.abc import Sequence
from typing import Any

from ...core.findings import Finding
from ..remedies import REMEDIES
from .tab import draw_sentence

_ICONS = {"difference": "INFO", "advice": "INFO", "missing": "LIBRARY_DATA_BROKEN"}

_MOST = 8
"""Sentences that are shown of a finding."""


def draw_findings(layout: Any, findings: Sequence[Finding], source: str, width: int) -> None:
    """Draw findings in lines of `width` characters.

    Parameters
    ----------
    source : str
        Which list they are of, for the operators that are told their number: 'check' or 'outcome'.
    """
    for i, finding in enumerate(findings):
        if finding.sentences == (finding.line,) and not finding.names and not finding.remedies:
            draw_sentence(layout.column(align=True), finding.line, _icon(finding), width)
            continue
        header, body = layout.panel(f"photon_bake_{source}_{finding.line}"[:60], default_closed=True)
        header.label(text=finding.line, icon=_icon(finding))
        if finding.names:
            select = header.operator("photon_bake.select_found", text="", icon="RESTRICT_SELECT_OFF", emboss=False)
            select.source, select.index = source, i
        if body is not None:
            _draw_body(body, finding, source, i, width)


def _draw_body(layout: Any, finding: Finding, source: str, index: int, width: int) -> None:
    column = layout.column(align=True)
    for sentence in finding.sentences[:_MOST]:
        draw_sentence(column, sentence, "DOT", width)
    if len(finding.sentences) > _MOST:
        column.label(text=f"and {len(finding.sentences) - _MOST:,} more", icon="BLANK1")
    for remedy in finding.remedies:
        button = layout.operator("photon_bake.remedy", text=REMEDIES[remedy][0])
        button.remedy, button.source, button.index = remedy, source, index


def _icon(finding: Finding) -> str:
    return "ERROR" if finding.blocks else _ICONS[finding.kind]
