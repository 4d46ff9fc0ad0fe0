"""What a source is to kernels that emit photons: a row of `Emitters`."""

from typing import NamedTuple

import numpy as np

from ..scene import LightKind

MESH, WORLD, PATTERN = len(LightKind), len(LightKind) + 1, len(LightKind) + 2
"""Kinds of sources after those of lamps: the last is that of all lamps with a pattern."""


class SourceRow(NamedTuple):
    """A source of photons.

    Attributes
    ----------
    kind : int
        A `LightKind`, `MESH`, `WORLD` or `PATTERN`.
    lamp : int
        Index in `Lights`; the number of lamps for emissive meshes, −1 for the world.
    n_cells : tuple of 5 int
        Into how many cells each dimension of the hypercube is cut where photons are guided: some thousands in all,
        along those that decide where the light arrives.
    power : (3,) float64 or None, W
        None: it is measured, as the mean flux of some photons.
    axis : (3,) float32
        Of the cone into which it emits.
    versine : float
        Of that cone's half angle.
    aims : bool
        That cone is around the scene and not the source's own.
    """

    kind: int
    lamp: int
    n_cells: tuple[int, int, int, int, int]
    power: np.ndarray | None
    axis: np.ndarray = np.array([0, 0, 1], np.float32)
    versine: float = 2.0
    aims: bool = False
