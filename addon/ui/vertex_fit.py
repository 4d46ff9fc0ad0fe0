"""How light becomes the values of vertices, in the panel."""

from typing import Any


def draw_vertex_fit(layout: Any, properties: Any) -> None:
    """Whether vertices are fitted to their faces, and denoised."""
    layout.prop(properties, "fit")
    layout.prop(properties, "denoise")
