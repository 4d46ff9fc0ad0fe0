"""Media: what absorbs and scatters light between surfaces, inside of closed meshes or everywhere."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Medium:
    """A homogeneous medium.

    Attributes
    ----------
    absorption, scattering : (3,) float32, 1/m
    anisotropy : float
        Mean cosine g of Henyey and Greenstein's phase function.
    """

    absorption: np.ndarray
    scattering: np.ndarray
    anisotropy: float = 0.0

    @property
    def extinction(self) -> np.ndarray:
        """Of absorption and scattering together, (3,) float32, 1/m."""
        return self.absorption + self.scattering


@dataclass(frozen=True)
class Media:
    """The media of a scene.

    Attributes
    ----------
    of_material : tuple of Medium or None
        What fills the inside of meshes whose triangles have a material; materials after the last have none.
    of_world : Medium or None
        What fills all space. Light from infinitely far away does not come through it.
    """

    of_material: tuple[Medium | None, ...] = ()
    of_world: Medium | None = None

    def bounded(self, material: np.ndarray, object_: np.ndarray) -> Iterator[tuple[Medium, np.ndarray]]:
        """Each medium inside of each object, and the triangles around it, (n,) int, of materials and objects (t,)."""
        filled = [number for number, medium in enumerate(self.of_material) if medium is not None]
        on = np.flatnonzero(np.isin(material, filled))
        on = on[np.lexsort((object_[on], material[on]))]
        starts = np.flatnonzero(np.diff(material[on], prepend=-1) | np.diff(object_[on], prepend=-1))
        for triangles in np.split(on, starts[1:]) if len(on) else ():
            medium = self.of_material[material[triangles[0]]]
            assert medium is not None
            yield medium, triangles
