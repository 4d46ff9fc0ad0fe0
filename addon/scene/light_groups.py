"""Light groups: which of a scene's lights belong together, and the scene as each group alone lights it."""

from dataclasses import dataclass

import numpy as np

from .scene import Scene
from .world import World

OTHER = "Other"
"""The name of the light that is in no group."""


@dataclass(frozen=True)
class LightGroups:
    """The groups of a scene's lights.

    Attributes
    ----------
    names : tuple of str
    of_lamp, of_object : (l,), (o,) int32
        Which group each lamp, and each object if it emits, is in; −1: in none.
    of_world : int
        Which group the world is in; −1: in none.
    """

    names: tuple[str, ...]
    of_lamp: np.ndarray
    of_object: np.ndarray
    of_world: int

    def apart(self, scene: Scene) -> dict[str, Scene]:
        """The scene once for each group that has lights, with these alone; those in no group are `OTHER`.

        There is one at least, be it dark. The light of all together is that of the scene.
        """
        scenes: dict[str, Scene] = {}
        shines = np.zeros(len(scene.objects.names), bool)
        shines[scene.object_of_triangle[scene.shines]] = True
        for i, name in [*enumerate(self.names), (-1, OTHER)]:
            lamps, emits, world = self.of_lamp == i, self.of_object == i, self.of_world == i
            if lamps.any() or (shines & emits).any() or (world and not scene.world.black):
                scenes[name] = scene.lit_by(lamps, emits, scene.world if world else World.constant(0))
        return scenes or {OTHER: scene}
