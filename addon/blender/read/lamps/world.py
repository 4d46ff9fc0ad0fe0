"""Blender's world as radiance."""

from dataclasses import dataclass, replace

import bpy
import numpy as np

from ....scene import RayKind, World
from ...temporary import CyclesError
from ...warn import Warnings
from ..materials.nodes import Place, output_node, uses_nodes
from .cycles_world import picture_of_world
from .light_shader import constant_emission
from .sky_suns import SkySun, discs_of


@dataclass(frozen=True)
class WorldReading:
    """A world as a dependency graph has it.

    Attributes
    ----------
    light : World
        Where `picture_of` is set, that of the Background node's own values.
    picture_of : bpy.types.World or None
        Original whose light only Cycles can tell.
    """

    light: World
    picture_of: "bpy.types.World | None" = None

    @property
    def n_suns(self) -> int:
        """How many suns it may have that are lamps."""
        return len(discs_of(self.picture_of)) if self.picture_of else 0

    def world(self, scene: "bpy.types.Scene", warnings: Warnings) -> tuple[World, list[SkySun]]:
        """The light, rendered by Cycles if need be, which it cannot while it bakes; `scene` is whose frame it is.

        Returns
        -------
        World
            Without the suns.
        list of SkySun
            `n_suns` of them.
        """
        if self.picture_of is None:
            return self.light, []
        black = SkySun(np.array([0.0, 0, 1]), np.zeros(3), 0.0)
        try:
            picture = picture_of_world(self.picture_of, scene)
            suns = [black if sun is None else sun for sun in picture.suns]
            return _hidden(_compact(picture.image), self.light.hidden_from), suns
        except CyclesError as error:
            warnings.add(
                f"World '{self.picture_of.name}': Cycles could not render it ({error}), so the Background node's own "
                "color and strength are baked: enable Cycles, or give the world one color."
            )
            return self.light, [black] * self.n_suns


def read_world(depsgraph: "bpy.types.Depsgraph", light_group: str = "") -> WorldReading:
    """The world of an evaluated dependency graph as light: one color, or what Cycles is to render of anything else.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
    light_group : str
        Black unless the world is in this light group; empty for any.
    """
    black = WorldReading(World.constant(0))
    view_layer = depsgraph.view_layer
    world = world_of(depsgraph)
    if world is None or not view_layer.use_sky:
        return black
    hidden_from = _hidden_from(world)
    if hidden_from == set(_FLAGS):
        return black
    if light_group and world.lightgroup != light_group:
        return black
    if not uses_nodes(world):
        return WorldReading(_hidden(World.constant(world.color[:3]), hidden_from))
    output = output_node(world)
    if output is None:
        return black
    surface = Place(output.inputs["Surface"])
    color = constant_emission(surface)
    if color is not None:
        return WorldReading(_hidden(World.constant(color), hidden_from))
    return WorldReading(_hidden(World.constant(_own_values(surface)), hidden_from), world.original)


def light_group_of_world(depsgraph: "bpy.types.Depsgraph") -> str:
    """The name of the light group that the world is in; empty where it is in none."""
    world = world_of(depsgraph)
    return str(world.lightgroup) if world else ""


def world_of(depsgraph: "bpy.types.Depsgraph") -> "bpy.types.World | None":
    """The world that a view layer shows."""
    return getattr(depsgraph.view_layer, "world_override", None) or depsgraph.scene.world


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


_FLAGS = {RayKind.DIFFUSE: "diffuse", RayKind.GLOSSY: "glossy", RayKind.TRANSMITTED: "transmission"}


def _hidden_from(world: "bpy.types.World") -> frozenset[RayKind]:
    """The rays that its Ray Visibility hides a world from."""
    visibility = getattr(world, "cycles_visibility", None)
    return frozenset(kind for kind, name in _FLAGS.items() if not getattr(visibility, name, True))


def _hidden(light: World, hidden_from: frozenset[RayKind]) -> World:
    return replace(light, hidden_from=hidden_from)
