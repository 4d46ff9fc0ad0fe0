"""Blender's world as radiance."""

import bpy
import numpy as np

from ..scene import World
from .cycles_world import picture_of_world
from .light_shader import constant_emission
from .nodes import Place, output_node, uses_nodes
from .temporary import CyclesError
from .warn import Warnings


def read_world(depsgraph: "bpy.types.Depsgraph", warnings: Warnings, light_group: str = "") -> World:
    """The world of a dependency graph as light: one colour, or a picture by Cycles where it is anything else.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        Evaluated.
    warnings : Warnings
        Told where Cycles cannot render; the Background node's own values are taken then.
    light_group : str
        Black unless the world is in this light group; empty for any.
    """
    world = getattr(depsgraph.view_layer, "world_override", None) or depsgraph.scene.world
    if world is None or not _seen_by_diffuse_rays(world) or (light_group and world.lightgroup != light_group):
        return World.constant(0)
    if not uses_nodes(world):
        return World.constant(world.color[:3])
    output = output_node(world)
    if output is None:
        return World.constant(0)
    surface = Place(output.inputs["Surface"])
    color = constant_emission(surface)
    if color is not None:
        return World.constant(color)
    try:
        return _compact(picture_of_world(world.original, depsgraph.scene))
    except CyclesError as error:
        warnings.add(
            f"World '{world.name}': Cycles could not render it ({error}), so the Background node's own colour and "
            "strength are baked: enable Cycles, or give the world one colour."
        )
        return World.constant(_own_values(surface))


def _own_values(surface: Place) -> np.ndarray:
    """Colour × strength of a Background node as they stand in its sockets, (3,); black for other shaders."""
    node = surface.origin.socket.node
    if node.type != "BACKGROUND":
        return np.zeros(3)
    return np.array(node.inputs["Color"].default_value[:3]) * node.inputs["Strength"].default_value


def _compact(picture: np.ndarray) -> World:
    """A world of one colour where a picture has only one."""
    if np.ptp(picture, axis=(0, 1)).max() <= 1e-5 * np.abs(picture).max():
        return World.constant(picture[0, 0])
    return World(np.ones(3, np.float32), picture)


def _seen_by_diffuse_rays(world: "bpy.types.World") -> bool:
    visibility = getattr(world, "cycles_visibility", None)
    return bool(getattr(visibility, "diffuse", True))
