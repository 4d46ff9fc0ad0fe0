"""Of more vertices than light can be found at, those that find it; the others take it from the nearest of these."""

from dataclasses import dataclass

import numpy as np

from ...core.compiling import kernel
from ...core.vec3 import BLACK, plus, put, row, times
from .surfaces import LiveSurfaces

_N_NEAREST = 3
_NORMALS_COUNT = 2.0  # cells that lie between opposite normals, twice
_APART = 1e6  # cells between objects
_ROUNDS = 12


@dataclass(frozen=True)
class Thinned:
    """Which of n vertices find light, and who takes it.

    Attributes
    ----------
    chosen : (m,) int64
        Vertices that do.
    nearest : (n, k) int64 or None
        For each vertex those of the chosen that it takes its light from, by their place in `chosen`; None: all find it.
    weight : (n, k) float32
        Of each of these.
    """

    chosen: np.ndarray
    nearest: np.ndarray | None = None
    weight: np.ndarray | None = None

    @staticmethod
    def of(surfaces: LiveSurfaces, n_most: int) -> "Thinned":
        """At most about `n_most` of the vertices, one of each cell of a grid, object and side that it shows."""
        n = len(surfaces)
        if n <= n_most:
            return Thinned(np.arange(n))
        position = np.concatenate([mesh.position for mesh in surfaces.meshes]).astype(np.float64)
        normal = np.concatenate([mesh.normal for mesh in surfaces.meshes]).astype(np.float64)
        chosen, cell = _one_of_each_cell(position, normal, surfaces.object_of_vertex, n_most)
        from scipy.spatial import cKDTree  # here, as Blender's start should not wait for it

        object_ = surfaces.object_of_vertex[:, None] * _APART
        places = np.concatenate([position / cell, _NORMALS_COUNT * normal, object_], axis=1)
        distance, nearest = cKDTree(places[chosen]).query(places, min(_N_NEAREST, len(chosen)))
        distance, nearest = distance.reshape(n, -1), nearest.reshape(n, -1)
        weight = np.where(distance > _APART / 2, 0, 1 / (distance**2 + 1e-6))
        return Thinned(chosen, nearest, (weight / weight.sum(axis=1, keepdims=True)).astype(np.float32))

    def spread(self, light: np.ndarray) -> np.ndarray:
        """The light of all vertices (n, 3) by that of the chosen (m, 3), as an array of its own."""
        if self.nearest is None or self.weight is None:
            return light.copy()
        spread = np.empty((len(self.nearest), 3), np.float32)
        _spread(light, self.nearest, self.weight, spread)
        return spread


@kernel
def _spread(light, nearest, weight, spread):
    for i in range(len(nearest)):
        total = BLACK
        for k in range(nearest.shape[1]):
            total = plus(total, times(row(light, nearest[i, k]), weight[i, k]))
        put(spread, i, total)


def _one_of_each_cell(
    position: np.ndarray, normal: np.ndarray, objects: np.ndarray, n_most: int
) -> tuple[np.ndarray, float]:
    """The first vertex of each cell of the finest grid that has few enough, and the size of its cells, m."""
    axis = np.abs(normal).argmax(axis=1)
    facing = 2 * axis + (np.take_along_axis(normal, axis[:, None], axis=1)[:, 0] < 0)
    of_kind = objects.astype(np.int64) * 6 + facing
    low, extent = position.min(axis=0), float(np.ptp(position, axis=0).max())
    fine, coarse = np.log2(extent) - 20, np.log2(extent) + 1
    chosen = np.unique(of_kind, return_index=True)[1]
    for _ in range(_ROUNDS):
        middle = (fine + coarse) / 2
        at = ((position - low) / 2**middle).astype(np.int64)
        key = of_kind * 0x9E3779B1 ^ at[:, 0] * 73856093 ^ at[:, 1] * 19349669 ^ at[:, 2] * 83492791
        _, first = np.unique(key, return_index=True)
        if len(first) > n_most:
            fine = middle
        else:
            chosen, coarse = first, middle
    return np.sort(chosen), float(2**coarse)
