"""The volumes that media fill, as kernels take them."""

from typing import NamedTuple

import numpy as np

from ...bsdf.phase.sampling import N_RINGS
from ...core.compiling import by_reference
from ...scene import Medium, Scene
from ..embree_library import EmbreeTree


@by_reference
class MediaArrays(NamedTuple):
    """The v volumes of a scene that media fill.

    Attributes
    ----------
    any : bool
        Whether there are any.
    tree : (v,) uint64
        Embree's, of the triangles around each; 0 where the medium fills all space, or all of its lattice.
    first : (v,) int32
        Where the triangles of each tree stand in `triangle`.
    triangle : (n,) int32
        Their numbers in the scene.
    low, high : (v, 3) float32, m
        The box around each.
    absorption, scattering : (v, 3) float32, 1/m
        Where the density is 1.
    anisotropy : (v,) float32
    table : (v,) int32
        Which of the m tables of rings is its phase function; −1 for Henyey and Greenstein's.
    rings : (m, N_RINGS + 1) float32
        See `bsdf.phase`.
    scatters : (v,) bool
    grid : (v,) int32
        Which of the g lattices says how dense each is; −1 for a density of one.
    grid_x, grid_y, grid_z, grid_shift : (g, 3) float32
        The rows, and the last column, of the affine map to the frame of a lattice, in which its cells are unit cubes.
    n_cells : (g, 3) int32
        Along its axes.
    first_cell : (g,) int64
        Where its cells stand in `cells`.
    cells : (n,) float32
        Densities.
    """

    any: bool
    tree: np.ndarray
    first: np.ndarray
    triangle: np.ndarray
    low: np.ndarray
    high: np.ndarray
    absorption: np.ndarray
    scattering: np.ndarray
    anisotropy: np.ndarray
    table: np.ndarray
    rings: np.ndarray
    scatters: np.ndarray
    grid: np.ndarray
    grid_x: np.ndarray
    grid_y: np.ndarray
    grid_z: np.ndarray
    grid_shift: np.ndarray
    n_cells: np.ndarray
    first_cell: np.ndarray
    cells: np.ndarray


_EVERYWHERE = np.full(3, -np.inf, np.float32), np.full(3, np.inf, np.float32)


class MediaVolumes:
    """The volumes of a scene that media fill: one for each object and medium, for each cloud, and for all space.

    Attributes
    ----------
    arrays : MediaArrays
        What kernels take; valid as long as this object lives.
    """

    def __init__(self, scene: Scene) -> None:
        found = list(scene.media.bounded(scene.material_of_triangle, scene.object_of_triangle))
        media, triangles = [medium for medium, _ in found], [on for _, on in found]
        corners = [scene.corners(on).reshape(-1, 3) for on in triangles]
        self._trees = [_tree_of(of_volume) for of_volume in corners]
        handles = [tree.handle for tree in self._trees]
        boxes = [(of_volume.min(0), of_volume.max(0)) for of_volume in corners]
        for medium in (*scene.media.clouds, scene.media.of_world):
            if medium is not None:
                media, handles, triangles = [*media, medium], [*handles, 0], [*triangles, np.zeros(0, int)]
                boxes.append(medium.density.bounds if medium.density else _EVERYWHERE)
        ends = np.cumsum([len(on) for on in triangles])
        low, high = (np.array([box[i] for box in boxes], np.float32).reshape(-1, 3) for i in range(2))
        absorption, scattering = (
            np.array([getattr(medium, name) for medium in media], np.float32).reshape(-1, 3)
            for name in ("absorption", "scattering")
        )
        self.arrays = MediaArrays(
            any=len(media) > 0,
            tree=np.array(handles, np.uint64),
            first=np.concatenate([[0], ends])[: len(media)].astype(np.int32),
            triangle=np.concatenate([np.zeros(0, int), *triangles]).astype(np.int32),
            low=low,
            high=high,
            absorption=absorption,
            scattering=scattering,
            anisotropy=np.array([medium.anisotropy for medium in media], np.float32),
            scatters=(scattering > 0).any(axis=1),
            **_tables(media),
            **_lattices(media),
        )


def _tables(media: list[Medium]) -> dict[str, np.ndarray]:
    """The tables of media's phase functions, each once, as members of `MediaArrays`."""
    tables = {id(medium.rings): medium.rings for medium in media if medium.rings is not None}
    number = {key: i for i, key in enumerate(tables)}
    return {
        "table": np.array([number.get(id(medium.rings), -1) for medium in media], np.int32),
        "rings": np.array(list(tables.values()), np.float32).reshape(-1, N_RINGS + 1),
    }


def _lattices(media: list[Medium]) -> dict[str, np.ndarray]:
    """The lattices of media's densities, as members of `MediaArrays`."""
    grids = [medium.density for medium in media if medium.density is not None]
    has_grid = np.array([medium.density is not None for medium in media], bool)
    maps = np.array([grid.grid_from_world for grid in grids], np.float32).reshape(-1, 3, 4)
    rows = [np.ascontiguousarray(maps[:, axis, :3]) for axis in range(3)]
    ends = np.cumsum([0, *(grid.values.size for grid in grids)])
    return {
        "grid": np.where(has_grid, np.cumsum(has_grid) - 1, -1).astype(np.int32),
        **dict(zip(("grid_x", "grid_y", "grid_z"), rows, strict=True)),
        "grid_shift": np.ascontiguousarray(maps[:, :, 3]),
        "n_cells": np.array([grid.values.shape for grid in grids], np.int32).reshape(-1, 3),
        "first_cell": ends[:-1].astype(np.int64),
        "cells": np.concatenate([np.zeros(0), *(grid.values.ravel() for grid in grids)]).astype(np.float32),
    }


def _tree_of(corners: np.ndarray) -> EmbreeTree:
    """The tree of triangles by their corners, (3 n, 3) float32, alone: the scene may have many times as many."""
    n = len(corners) // 3
    return EmbreeTree(corners, np.arange(3 * n).reshape(n, 3), np.ones(n, bool))
