"""Fuzzy occlusion G between neighbouring cells (section 4.2)."""

import numpy as np
from scipy.ndimage import binary_dilation

from ...core.parallel import Workers
from ...tracing import Tracer
from .grid import Grid

_N_SIDE = 2  # points along a side of the face between two cells
_CHUNK = 1 << 14  # faces
_STREAM = 62  # the chunks draw no random numbers


def transmittance(tracer: Tracer, grid: Grid, response: np.ndarray, workers: Workers) -> np.ndarray:
    """Share of the ways from each cell's centre to the next one's along an axis that nothing blocks.

    The ways lead over points spread evenly on the face between the cells, straight to them and straight on, so that
    there is none around a wall's end that light would not find. Far from any surface they are not traced.

    Parameters
    ----------
    response : (4, 4, cells) float32
        From `inject_response`: where there are surfaces.

    Returns
    -------
    (3, nx, ny, nz) float32
        G along x, y and z; 1 for the last cell of each row.
    """
    cells = np.flatnonzero(_near(response[0, 0].reshape(grid.shape) > 0))
    steps = (np.arange(_N_SIDE, dtype=np.float32) + np.float32(0.5)) / _N_SIDE - np.float32(0.5)
    on_face = np.array([(0.5, s, t) for s in steps for t in steps], np.float32)

    def share(chunk: slice, _: np.random.Generator) -> np.ndarray:
        axis, cell = np.divmod(np.arange(chunk.start, chunk.stop), len(cells))
        # Points of a face across x, turned to the axis by a cyclic change of the coordinates
        turn = (np.arange(3) - axis[:, None]) % 3
        length, n = np.float32(grid.length), len(on_face)
        centre = grid.centres(cells[cell])
        over = (centre[:, None] + on_face.T[turn].transpose(0, 2, 1) * length).reshape(-1, 3)
        following = centre + np.eye(3, dtype=np.float32)[axis] * length
        blocked = tracer.occluded(np.repeat(centre, n, 0), over) | tracer.occluded(over, np.repeat(following, n, 0))
        return 1 - blocked.reshape(-1, n).mean(axis=1, dtype=np.float32)

    passes = np.ones((3, grid.n_cells), np.float32)
    for chunk, shares in workers.chunks("Looking between cells", 3 * len(cells), _CHUNK, share, (_STREAM,)):
        axis, cell = np.divmod(np.arange(chunk.start, chunk.stop), len(cells))
        passes[axis, cells[cell]] = shares
    return passes.reshape(3, *grid.shape)


def _near(surface: np.ndarray) -> np.ndarray:
    """Cells with surface, and their 26 neighbours: light is put half a cell off the surface that it belongs to."""
    return binary_dilation(surface, np.ones((3, 3, 3), bool))
