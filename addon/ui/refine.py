"""What the panel says of meshes that are too coarse for their light."""

from typing import Any

from ..errors import TooCoarse
from .state import bake_state


def draw_refine(layout: Any, context: Any) -> None:
    """A button that refines the meshes that the last bake found too coarse; nothing where it found none."""
    names = [name for warning in bake_state.warnings if isinstance(warning, TooCoarse) for name in warning.names]
    if not names or bake_state.running:
        return
    text = "Refine 1 Object" if len(names) == 1 else f"Refine {len(names)} Objects"
    button = layout.operator("photon_bake.refine", text=text, icon="MOD_TRIANGULATE")
    for name in names:
        button.objects.add().name = name
