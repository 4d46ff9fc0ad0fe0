"""Sides of surfaces that face no light: the insides of solids, where neither rays from the receivers nor photons end.

Where walls run into each other, a part of each lies inside the other. No ray ends there, and the mean over an element
must not count it: elements at the edges of a room would be darker than what is seen of them.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...core.compiling import part
from ...core.sampling.vectors import dot
from ...photons import Photons
from ...scene import Scene

_LEAST_ENDS = 200  # of rays on an object, by which its sides are told apart
_STRAY = 0.01
"""Share of rays, or of photons, that may end on a hidden side: receivers may be inside themselves, light may leak."""


@dataclass(frozen=True)
class HiddenSides:
    """Sides of o objects.

    Attributes
    ----------
    of_object : (2 o,) bool
        Whether it is hidden: front at 2k, back at 2k + 1.
    """

    of_object: np.ndarray

    @cached_property
    def any(self) -> bool:
        return bool(self.of_object.any())

    @staticmethod
    def of(scene: Scene, triangle: np.ndarray, back: np.ndarray) -> "HiddenSides":
        """Of all objects on which many rays end, the side on which next to none does.

        Parameters
        ----------
        triangle : (n,) int32
            On which rays from receivers ended, and rays from there on.
        back : (n,) bool
            Whether they ended on its back.
        """
        few, n = _few_end(scene, triangle, back)
        return HiddenSides(few & (n >= _LEAST_ENDS))

    def unlit(self, scene: Scene, photons: Photons) -> "HiddenSides":
        """Those on which next to no photons end: behind a curtain there may be light that gets to those before it."""
        back = dot(scene.normals[photons.triangle], photons.normal) < 0
        return HiddenSides(self.of_object & _few_end(scene, photons.triangle, back)[0])


@part
def is_hidden(scene, hidden, triangle, back):
    """Whether a side of a triangle is hidden (`HiddenSides.of_object`): rays that come to it start inside a solid."""
    return hidden[2 * scene.object[triangle] + np.int32(back)]


def _few_end(scene: Scene, triangle: np.ndarray, back: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """On which sides (2 o,) of objects next to none ends of what ends on the object, and how many that are, (2 o,)."""
    n_objects = int(scene.object_of_triangle.max(initial=-1)) + 1
    sides = np.bincount(2 * scene.object_of_triangle[triangle] + back, minlength=2 * n_objects)
    both = np.repeat(sides.reshape(-1, 2).sum(axis=1), 2)
    return sides <= _STRAY * both, both
