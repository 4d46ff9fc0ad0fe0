"""Which lamp to ask for light: those that give much where the light is wanted, more often."""

from typing import NamedTuple

import numpy as np

from ...core.compiling import by_reference, part
from ...core.sampling.cutpoint_table import CutpointTable, chance_of, cutpoint_table, drawn_cell
from ...core.vec3 import minus
from ...emitters.area import areas_of
from ...emitters.patterns.arrays import PatternArrays
from ...emitters.patterns.pattern import fall_offs
from ...scene import AREA_LAMPS, LightKind, Scene

_MAX_CELLS_A_SIDE = 16
_MAX_CHANCES = 1 << 22
_EVEN = 0.25
"""Share of the chance that all lamps have alike: cells know nothing of normals, cones and shadows."""


@by_reference
class LampGrid(NamedTuple):
    """Lamps' chances by the irradiance that each gives in the cells of a grid over the scene.

    Attributes
    ----------
    low, cell : triples, m
        Lowest corner, and size of a cell.
    per_side : int
    table : CutpointTable
        A row for each cell, of all lamps.
    """

    low: tuple
    cell: tuple
    per_side: int
    table: CutpointTable


def lamp_grid(scene: Scene, patterns: PatternArrays, lit: np.ndarray) -> LampGrid:
    """The grid of a scene's lamps, of which those may be drawn that are `lit` (l,) bool."""
    per_side = int(np.cbrt(_MAX_CHANCES / max(len(lit), 1)))
    per_side = 1 if lit.sum() <= 1 else min(max(per_side, 1), _MAX_CELLS_A_SIDE)
    low, high = scene.bounds
    cell = np.maximum((high - low) / per_side, np.float32(1e-6)).astype(np.float32)
    steps = np.arange(per_side) + 0.5
    middles = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    give = _irradiance(scene, patterns, (low + middles * cell).astype(np.float32), float((cell**2).sum()) / 4) * lit
    chance = (1 - _EVEN) * give / np.maximum(give.sum(axis=1, keepdims=True), 1e-300)
    chance += lit * (1 - chance.sum(axis=1, keepdims=True)) / max(lit.sum(), 1)
    corner, size = (tuple(np.float32(x) for x in triple) for triple in (low, cell))
    return LampGrid(corner, size, per_side, cutpoint_table(np.cumsum(chance, axis=1)))


@part
def cell_of(grid, position):
    """The cell of a position; of one outside of the grid, the nearest."""
    place, n = minus(position, grid.low), grid.per_side
    x = min(max(np.int64(place[0] / grid.cell[0]), 0), n - 1)
    y = min(max(np.int64(place[1] / grid.cell[1]), 0), n - 1)
    z = min(max(np.int64(place[2] / grid.cell[2]), 0), n - 1)
    return (x * n + y) * n + z


@part
def choose_lamp(grid, cell, u):
    """A lamp for a cell and a number in [0, 1), and its chance."""
    lamp = drawn_cell(grid.table, cell, u)
    return lamp, np.float32(chance_of(grid.table, cell, lamp))


def _irradiance(scene: Scene, patterns: PatternArrays, positions: np.ndarray, least: float) -> np.ndarray:
    """About the irradiance that each lamp gives, or takes from, surfaces at positions that face it, (n, l) float64.

    Parameters
    ----------
    least : float, m²
        Squared size of the place that each position stands for.
    """
    lights = scene.lights
    strength = np.abs(lights.emission).mean(axis=1, dtype=np.float64)
    strength *= [1 if of is None else np.abs(of.values).mean(dtype=np.float64) for of in lights.patterns]
    strength = strength * np.where(np.isin(lights.kind, AREA_LAMPS), areas_of(lights), 1)
    give = np.empty((len(positions), len(lights)))
    for lamp, position in enumerate(lights.position):
        distance2 = ((positions - position) ** 2).sum(axis=1)
        far = lights.kind[lamp] == LightKind.SUN
        give[:, lamp] = strength[lamp] * (1 if far else 1 / (distance2 + least))
        if patterns.differs[lamp]:
            give[:, lamp] *= fall_offs(patterns, lamp, np.sqrt(distance2 + least))
    return give
