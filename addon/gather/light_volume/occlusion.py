"""Fuzzy occlusion G between neighbouring cells (section 4.2)."""

import numpy as np
from scipy.ndimage import binary_dilation

from ...core.compiling import kernel, part
from ...core.parallel import Workers
from ...core.vec3 import ONE, ZERO, put
from ...tracing import Tracer
from .grid import Grid, centre_of

_N_SIDE = 2  # points along a side of the face between two cells
_N_POINTS = _N_SIDE**2
_HALF = np.float32(0.5)
_CHUNK = 1 << 14  # faces
_STREAM = 62  # the chunks draw no random numbers


def transmittance(tracer: Tracer, grid: Grid, response: np.ndarray, workers: Workers) -> np.ndarray:
    """Share of the ways from each cell's centre to the next one's along an axis that nothing blocks.

    The ways lead over points spread evenly on the face between the cells, straight to them and straight on, so that
    there is none around a wall's end that light would not find. Far from any surface they are not traced.

    Parameters
    ----------
    response : (cells, 4, 4) float32
        From `response_of`: where there are surfaces.

    Returns
    -------
    (nx, ny, nz, 3) float32
        G along x, y and z; 1 for the last cell of each row.
    """
    cells = np.flatnonzero(_near(response[:, 0, 0].reshape(grid.shape) > 0))

    def share(chunk: slice, _: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        axis, nth = np.divmod(np.arange(chunk.start, chunk.stop), len(cells))
        cell = cells[nth]
        starts, ends = np.empty((2, len(cell), 2 * _N_POINTS, 3), np.float32)
        _ways_over_faces(grid.arrays, cell, axis, starts, ends)
        blocked = tracer.occluded(starts.reshape(-1, 3), ends.reshape(-1, 3)).reshape(-1, _N_POINTS, 2)
        return cell, axis, 1 - blocked.any(axis=2).mean(axis=1, dtype=np.float32)

    passes = np.ones((grid.n_cells, 3), np.float32)
    for _, (cell, axis, shares) in workers.chunks("Looking between cells", 3 * len(cells), _CHUNK, share, (_STREAM,)):
        passes[cell, axis] = shares
    return passes.reshape(*grid.shape, 3)


@kernel
def _ways_over_faces(grid, cells, axes, starts, ends):
    """The two halves of each way over the face that cells (n,) share with the next one along an axis (n,).

    Parameters
    ----------
    starts, ends : (n, 2 · _N_POINTS, 3) float32, m
        Of the halves.
    """
    for k in range(len(cells)):
        axis, centre = axes[k], centre_of(grid, cells[k])
        following = _moved(grid, centre, axis, ONE)
        for point in range(_N_POINTS):
            s, t = _step(point // _N_SIDE), _step(point % _N_SIDE)
            over = _moved(grid, centre, axis, _HALF)
            over = _moved(grid, _moved(grid, over, (axis + 1) % 3, s), (axis + 2) % 3, t)
            put(starts[k], 2 * point, centre)
            put(ends[k], 2 * point, over)
            put(starts[k], 2 * point + 1, over)
            put(ends[k], 2 * point + 1, following)


@part
def _step(point):
    """Where a point lies along a face's side, from its middle, over the side's length."""
    return (np.float32(point) + _HALF) / np.float32(_N_SIDE) - _HALF


@part
def _moved(grid, x, axis, n):
    """A point moved n cells along an axis."""
    way = grid.length * n
    return x[0] + (way if axis == 0 else ZERO), x[1] + (way if axis == 1 else ZERO), x[2] + (way if axis == 2 else ZERO)


def _near(surface: np.ndarray) -> np.ndarray:
    """Cells with surface, and their 26 neighbours: light is put half a cell off the surface that it belongs to."""
    return binary_dilation(surface, np.ones((3, 3, 3), bool))
