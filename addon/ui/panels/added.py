"""Where sections that have files of their own come into the panels: a line each."""

from collections.abc import Callable, Mapping
from typing import Any

from ..mixer_panel import draw_mixer
from ..show_panel import draw_baked_light, draw_pass, draw_remove_lightmaps

Draw = Callable[[Any, Any], None]
"""Draws into a layout, for a context."""

ADDED: Mapping[str, tuple[Draw, ...]] = {
    "bake": (draw_baked_light, draw_pass, draw_mixer),  # under the settings
    "vertices": (),
    "lightmaps": (draw_remove_lightmaps,),
    "camera": (),
    "probes": (),
}
"""What panels draw at their end."""


def draw_added(panel: str, layout: Any, context: Any) -> None:
    """Draw what is added to a panel."""
    for draw in ADDED[panel]:
        draw(layout, context)
