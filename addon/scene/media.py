"""Media: what absorbs and scatters light between surfaces, inside of closed meshes or everywhere."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class VoxelGrid:
    """Numbers in the cells of a lattice, and zero around it.

    Attributes
    ----------
    values : (x, y, z) float32
    grid_from_world : (3, 4) float32
        To a frame in which cell (i, j, k) is the unit cube whose least corner that is.
    """

    values: np.ndarray
    grid_from_world: np.ndarray

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """The least and the largest corner of the box around it along the world's axes, (3,) float32."""
        world_from_grid = np.linalg.inv(self.grid_from_world[:, :3].astype(np.float64))
        corners = np.indices((2, 2, 2)).reshape(3, -1).T * self.values.shape - self.grid_from_world[:, 3]
        in_world = (corners @ world_from_grid.T).astype(np.float32)
        return in_world.min(axis=0), in_world.max(axis=0)


@dataclass(frozen=True)
class Medium:
    """A medium whose kind is the same all over, and whose density may differ.

    Attributes
    ----------
    absorption, scattering : (3,) float32, 1/m
        Where the density is 1.
    anisotropy : float
        Mean cosine g of Henyey and Greenstein's phase function.
    rings : (n + 1,) float32 or None
        Of another phase function: versines 1 − cos θ, from 0 to 2, between each two of which light is scattered as
        likely as between any others (`bsdf.phase_functions.rings_of`).
    density : VoxelGrid or None
        None where it is 1 everywhere.
    """

    absorption: np.ndarray
    scattering: np.ndarray
    anisotropy: float = 0.0
    rings: np.ndarray | None = None
    density: VoxelGrid | None = None

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
    of_object : mapping of (int, int) to Medium or None
        What fills the inside of a material and an object, where it differs from one object to another.
    clouds : tuple of Medium
        What has no mesh around it, but a density.
    """

    of_material: tuple[Medium | None, ...] = ()
    of_world: Medium | None = None
    of_object: Mapping[tuple[int, int], Medium | None] = field(default_factory=dict)
    clouds: tuple[Medium, ...] = ()

    def bounded(self, material: np.ndarray, object_: np.ndarray) -> Iterator[tuple[Medium, np.ndarray]]:
        """Each medium inside of each object, and the triangles around it, (n,) int, of materials and objects (t,)."""
        filled = [number for number, medium in enumerate(self.of_material) if medium is not None]
        for key, triangles in by_object(material, object_, {*filled, *(number for number, _ in self.of_object)}):
            medium = self.of_object[key] if key in self.of_object else self.of_material[key[0]]
            if medium is not None:
                yield medium, triangles


def by_object(
    material: np.ndarray, object_: np.ndarray, wanted: set[int]
) -> Iterator[tuple[tuple[int, int], np.ndarray]]:
    """The triangles (n,) int of each wanted material on each object, by both their numbers."""
    on = np.flatnonzero(np.isin(material, list(wanted)))
    on = on[np.lexsort((object_[on], material[on]))]
    starts = np.flatnonzero(np.diff(material[on], prepend=-1) | np.diff(object_[on], prepend=-1))
    for triangles in np.split(on, starts[1:]) if len(on) else ():
        yield (int(material[triangles[0]]), int(object_[triangles[0]])), triangles
