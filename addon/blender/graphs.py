"""Evaluated dependency graphs of scenes."""

from collections.abc import Callable
from typing import TypeVar

import bpy

T = TypeVar("T")


def in_graph(
    scene: "bpy.types.Scene", view_layer: "bpy.types.ViewLayer", work: "Callable[[bpy.types.Depsgraph], T]"
) -> T:
    """What `work` returns for the evaluated graph of a view layer; for the main thread.

    Parameters
    ----------
    scene : bpy.types.Scene
    view_layer : bpy.types.ViewLayer
        Of the scene.
    work : callable
        Keeps nothing of the graph.
    """
    with bpy.context.temp_override(scene=scene, view_layer=view_layer):
        return work(bpy.context.evaluated_depsgraph_get())
