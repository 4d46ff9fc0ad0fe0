"""Which lamp to ask for light: those that give much where the light is wanted, more often."""

import numpy as np

from ..core.sampling.cutpoint_table import Inversion
from ..scene import LightKind, Scene

_MAX_CELLS_A_SIDE = 16
_MAX_CHANCES = 1 << 22
_EVEN = 0.25
"""Share of the chance that all lamps have alike: cells know nothing of normals, cones and shadows."""


class LampChoice:
    """Lamps drawn by the irradiance that each gives in the cell of a grid over the scene.

    Parameters
    ----------
    lit : (l,) bool
        Lamps that may be drawn.
    """

    def __init__(self, scene: Scene, lit: np.ndarray) -> None:
        if not lit.any():
            return
        per_side = int(np.cbrt(_MAX_CHANCES / len(lit)))
        self._per_side = 1 if lit.sum() == 1 else min(max(per_side, 1), _MAX_CELLS_A_SIDE)
        low, high = scene.bounds
        self._low, self._cell = low, np.maximum((high - low) / self._per_side, np.float32(1e-6)).astype(np.float32)
        give = _irradiance(scene, self._centres(), float((self._cell**2).sum()) / 4) * lit
        chance = (1 - _EVEN) * give / np.maximum(give.sum(axis=1, keepdims=True), 1e-300)
        chance += lit * (1 - chance.sum(axis=1, keepdims=True)) / lit.sum()
        self._lamps = Inversion(np.cumsum(chance, axis=1))
        self._chance = chance.astype(np.float32)

    def choose(self, positions: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A lamp for each of n positions and numbers in [0, 1), and its chance: (n,) int and (n,) float32."""
        place = ((positions - self._low) / self._cell).astype(np.int64)
        x, y, z = np.clip(place, 0, self._per_side - 1).T
        cell = (x * self._per_side + y) * self._per_side + z
        lamp = self._lamps.cells(cell, u)
        return lamp, self._chance[cell, lamp]

    def _centres(self) -> np.ndarray:
        """Middles of all cells, (cells, 3) float32, m."""
        steps = np.arange(self._per_side) + 0.5
        grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
        return (self._low + grid * self._cell).astype(np.float32)


def _irradiance(scene: Scene, positions: np.ndarray, least: float) -> np.ndarray:
    """About the irradiance that each lamp gives, or takes from, surfaces at positions that face it, (n, l) float64.

    Parameters
    ----------
    least : float, m²
        Squared size of the place that each position stands for.
    """
    lights = scene.lights
    strength = np.abs(lights.emission).mean(axis=1, dtype=np.float64)
    strength = strength * np.where(lights.kind >= LightKind.RECTANGLE, lights.area(np.arange(len(lights))), 1)
    give = np.empty((len(positions), len(lights)))
    for lamp, position in enumerate(lights.position):
        distance2 = ((positions - position) ** 2).sum(axis=1)
        far = lights.kind[lamp] == LightKind.SUN
        give[:, lamp] = strength[lamp] * (1 if far else 1 / (distance2 + least))
    return give
