"""Which maps see a place, without asking all of them."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ....core.compiling import by_reference, kernel_array, part
from ....core.parallel import Workers
from ....core.sampling.streams import stream
from ....core.sampling.vectors import dot
from ..cube_maps import CubeMaps
from ..stage import each

_N_CELLS = 16**3  # about as many in the region
_N_CHOICES = 6  # maps a cell
_N_POINTS = 4  # of a cell, where visibility is looked at
_STREAM = 51


@by_reference
class MapIndexArrays(NamedTuple):
    """The arrays of a `MapIndex`, for kernels."""

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    choices: np.ndarray
    reach: np.float32


@part
def cell_at(index, p):
    """The cell of an index that a point is in; outside of them all the nearest."""
    column = _interval(index.x, p[0])
    column = column * (len(index.y) - 1) + _interval(index.y, p[1])
    return column * (len(index.z) - 1) + _interval(index.z, p[2])


@part
def _interval(edges, x):
    """The interval between ascending edges that a number is in, by bisection; outside of them all the nearest."""
    low, high = 0, len(edges) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if edges[middle] < x:
            low = middle
        else:
            high = middle
    return low


@dataclass(frozen=True)
class MapIndex:
    """A grid whose cells know the maps that see them best: however many maps there are, a ray asks a few.

    Over a region the cells are cubes; a shell of large cells around them reaches to the bounds of the scene.

    Attributes
    ----------
    edges : tuple of three (≥ 4,) float32, m
        Where cells begin along each axis, and the last one ends.
    choices : (cells, c) int32
        Maps of each cell, the best first.
    reach : float, m
        Diagonal of a cell in the region.
    """

    edges: tuple[np.ndarray, np.ndarray, np.ndarray]
    choices: np.ndarray
    reach: float

    @staticmethod
    def of(maps: CubeMaps, region: np.ndarray, bounds: np.ndarray, workers: Workers) -> "MapIndex":
        """The index to maps in a region (2, 3) of a scene with some bounds (2, 3).

        A map is the better the more points of a cell it sees, and the nearer it is, since its texels are then small.
        """
        extent = region[1] - region[0]
        side = (extent.prod() / _N_CELLS) ** (1 / 3)
        low, high = np.minimum(bounds[0], region[0]) - side, np.maximum(bounds[1], region[1]) + side
        inner = [np.linspace(region[0, a], region[1, a], int(np.ceil(extent[a] / side)) + 1) for a in range(3)]
        x, y, z = (np.concatenate([low[a : a + 1], inner[a], high[a : a + 1]]).astype(np.float32) for a in range(3))
        corner, size = (
            np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
            for axes in ((x[:-1], y[:-1], z[:-1]), (np.diff(x), np.diff(y), np.diff(z)))
        )
        places = stream(workers.seed, _STREAM).random((_N_POINTS, *corner.shape), np.float32)

        def score(number: int) -> np.ndarray:
            which, n_seen = np.full(len(corner), number), np.zeros(len(corner), np.float32)
            for place in places:
                p = corner + place * size - maps.centres[number]
                normal, h = maps.plane(maps.texel(which, p)[0])
                n_seen += dot(normal, p) > h
            to_middle = corner + size / 2 - maps.centres[number]
            return (1 + n_seen) / (np.sqrt(dot(to_middle, to_middle)) + size.max(axis=1))

        scores = np.stack(list(each(workers, score, range(len(maps)))), axis=1)
        choices = np.argsort(-scores, axis=1, kind="stable")[:, :_N_CHOICES].astype(np.int32)
        return MapIndex((x, y, z), choices, float(side * np.sqrt(3)))

    @cached_property
    def arrays(self) -> MapIndexArrays:
        """What kernels read."""
        x, y, z = (kernel_array(edges, np.float32) for edges in self.edges)
        return MapIndexArrays(x, y, z, kernel_array(self.choices, np.int32), np.float32(self.reach))
