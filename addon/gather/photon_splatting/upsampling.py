"""Light found in few pixels and interpolated to all: joint bilateral upsampling (McGuire and Luebke, section 5.2).

A point takes those of the four pixels of a coarse grid around it, by bilinear weights, and by how much they lie on its
own surface. One that resembles none of them is lit for itself, so that neither edges nor thin things are blurred.
"""

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_matrix

from ...core.parallel import Workers
from ...core.ranges import repeat_ranges
from ...core.sampling.vectors import dot
from ...receivers import Camera, SeenSurface
from ...receivers.camera.camera import LEAST_COSINE

_LEAST_WEIGHT = np.float32(0.05)  # of all four, below which they tell nothing of a point
_SHARPNESS = 8  # power of the cosine between normals: a half at 24°
_APART = np.float32(2)  # diagonals of the grid's pixels, that points of one surface may lie apart
_CHUNK = 1 << 16  # points

_UPSAMPLING = 84  # stream of random numbers, of which there are none

Light = Callable[[np.ndarray], np.ndarray]
"""What is to be found: values (n, c) float32 at points of given indices (n,)."""


def upsampled(camera: Camera, seen: SeenSurface, step: int, light: Light, workers: Workers) -> np.ndarray:
    """`light` (p, c) float32 at what a camera sees, found in one of `step`² pixels and where those do not suffice."""
    if step == 1 or len(seen) == 0:
        return light(np.arange(len(seen)))
    grid = _Grid(camera, seen, step)
    parts = [part for _, part in workers.chunks("Upsampling", len(seen), _CHUNK, grid.weights, (_UPSAMPLING,))]
    weight, of, counts = (np.concatenate(column) for column in zip(*parts, strict=True))
    ends = np.concatenate([[0], np.cumsum(counts)])
    weights = csr_matrix((weight, of, ends), shape=(len(seen), len(grid.points)))
    total = np.asarray(weights.sum(axis=1)).ravel()
    alone = np.flatnonzero(total < _LEAST_WEIGHT)
    found = light(np.concatenate([grid.points, alone]))  # in one go: to look through all photons takes time
    values = weights @ found[: len(grid.points)] / np.maximum(total, np.float32(1e-30))[:, None]
    values[alone] = found[len(grid.points) :]
    return values


class _Grid:
    """The points in every `step`-th pixel of every `step`-th row; in a pixel there may be several or none.

    Attributes
    ----------
    points : (k,) int64
        Indices of the points, cell by cell.
    """

    def __init__(self, camera: Camera, seen: SeenSurface, step: int) -> None:
        self._seen, self._step = seen, step
        self._row, self._column = np.divmod(seen.pixel, camera.width)
        self._shape = -(-camera.height // step), -(-camera.width // step)
        on = np.flatnonzero((self._row % step == 0) & (self._column % step == 0))
        cell = self._row[on] // step * self._shape[1] + self._column[on] // step
        order = np.argsort(cell, kind="stable")
        self.points = on[order]
        self._start = np.searchsorted(cell[order], np.arange(self._shape[0] * self._shape[1] + 1))
        cosine = np.maximum(np.abs(dot(seen.normal, seen.direction)), LEAST_COSINE)
        self._side = step * np.sqrt(seen.area)
        self._diagonal = self._side * np.sqrt(cosine + 1 / cosine)

    def weights(self, chunk: slice, _: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows of a sparse matrix, for a chunk of all points: weights, which of `points` they are of, how many a row.

        A weight is bilinear in the picture, times cos⁸ between normals, times how near the planes are. Beyond a bound
        in space it is 0: pixels that are close in the picture may be rooms apart.
        """
        row, column = self._row[chunk], self._column[chunk]
        corner = np.array([[0, 0], [0, 1], [1, 0], [1, 1]])
        i, j = ((at // self._step)[:, None] + shift for at, shift in zip((row, column), corner.T, strict=True))
        near = (1 - np.abs(row[:, None] / self._step - i)) * (1 - np.abs(column[:, None] / self._step - j))
        inside = (i < self._shape[0]) & (j < self._shape[1]) & (near > 0)
        cell = np.where(inside, i * self._shape[1] + j, 0)
        of_corner, k = repeat_ranges(np.where(inside, self._start[cell + 1] - self._start[cell], 0).ravel())
        other, at = self._start[cell.ravel()[of_corner]] + k, chunk.start + of_corner // 4
        alike = self._alike(at, self.points[other]) * near.ravel()[of_corner].astype(np.float32)
        some = np.flatnonzero(alike > 0)
        counts = np.bincount(at[some] - chunk.start, minlength=len(row))
        return alike[some], other[some].astype(np.int32), counts

    def _alike(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """How much points b (m,) lie on the surface of points a (m,), (m,) float32 in [0, 1]."""
        seen = self._seen
        normal, away = seen.normal[a], seen.position[b] - seen.position[a]
        normals = np.maximum(dot(seen.normal[b], normal), 0) ** _SHARPNESS
        planes = np.maximum(1 - np.abs(dot(away, normal)) / self._side[a], 0)
        return normals * planes * (dot(away, away) <= (_APART * self._diagonal[a]) ** 2)
