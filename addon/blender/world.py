"""Blender's world as radiance."""

import bpy
import numpy as np

from ..scene import World
from .nodes import number, surface_node, uses_nodes, vector
from .warn import Warnings


def read_world(world: "bpy.types.World | None", warnings: Warnings) -> World:
    """The world as light, the same in every direction: the Background node's colour × strength.

    Parameters
    ----------
    world : bpy.types.World or None
    warnings : Warnings
        Told where nodes cannot be read; their sockets' own values are taken then.

    Returns
    -------
    World
    """
    black = World.constant(0)
    if world is None or not _seen_by_diffuse_rays(world):
        return black
    if not uses_nodes(world):
        return World.constant(world.color[:3])
    node = surface_node(world)
    if node is None:
        return black
    if node.type != "BACKGROUND":
        warnings.add(f"World '{world.name}': its {node.bl_label} cannot be read yet and is baked as black.")
        return black
    color, strength = vector(node.inputs["Color"]), number(node.inputs["Strength"])
    if color is None or strength is None:
        warnings.add(
            f"World '{world.name}': its nodes cannot be read yet, so the Background node's own colour and strength "
            "are baked."
        )
        color = np.array(node.inputs["Color"].default_value[:3]) if color is None else color
        strength = float(node.inputs["Strength"].default_value) if strength is None else strength
    return World.constant(np.maximum(color * strength, 0))


def _seen_by_diffuse_rays(world: "bpy.types.World") -> bool:
    visibility = getattr(world, "cycles_visibility", None)
    return bool(getattr(visibility, "diffuse", True))
