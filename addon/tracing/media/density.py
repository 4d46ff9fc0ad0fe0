"""The density of media along rays: one, or what the cells of a lattice say.

A ray goes from cell to cell (Amanatides and Woo 1987), and what it passes is summed exactly: of a density that is the
same within each cell neither a flight nor what is left of light needs random numbers (regular tracking).
"""

import numpy as np

from ...core.compiling import part, routine
from ...core.vec3 import ONE, ZERO, row
from ..embree import INFINITY


@part
def density_at(media, k, x):
    """The density of the k-th volume at a point."""
    grid = media.grid[k]
    if grid < 0:
        return ONE
    a = _to_grid(media, grid, x, ONE)
    n = media.n_cells[grid, 0], media.n_cells[grid, 1], media.n_cells[grid, 2]
    if not (ZERO <= a[0] <= n[0] and ZERO <= a[1] <= n[1] and ZERO <= a[2] <= n[2]):
        return ZERO
    return media.cells[_index(media, grid, _cell(a[0], n[0]), _cell(a[1], n[1]), _cell(a[2], n[2]))]


@routine
def mass_between(media, k, origin, direction, start, end, most):
    """What a ray passes of the k-th volume between two distances, ∫ρ dt, m; and at which of them that is `most`.

    Returns
    -------
    mass : float32, m
    distance : float32, m
        Infinite where the mass is not above `most`.
    """
    grid = media.grid[k]
    if grid < 0:
        length = end - start
        return (most, start + most) if length > most else (length, INFINITY)
    # Where the ray is inside of the lattice, in whose frame cells are unit cubes
    o, d = _to_grid(media, grid, origin, ONE), _to_grid(media, grid, direction, ZERO)
    n = media.n_cells[grid, 0], media.n_cells[grid, 1], media.n_cells[grid, 2]
    t, end = _clipped(o, d, n, start, end)
    if not t < end:
        return ZERO, INFINITY
    i, j, m = _cell(o[0] + t * d[0], n[0]), _cell(o[1] + t * d[1], n[1]), _cell(o[2] + t * d[2], n[2])
    mass = ZERO
    while True:
        # To the nearest of the three planes by which the ray may leave its cell
        x, y, z = _leaves(o[0], d[0], i), _leaves(o[1], d[1], j), _leaves(o[2], d[2], m)
        leaves = max(min(min(x, y), min(z, end)), t)
        density = media.cells[_index(media, grid, i, j, m)]
        added = density * (leaves - t)
        if mass + added > most:
            return most, t + (most - mass) / density
        mass, t = mass + added, leaves
        if t >= end:
            return mass, INFINITY
        if x <= y and x <= z:
            i += 1 if d[0] > ZERO else -1
        elif y <= z:
            j += 1 if d[1] > ZERO else -1
        else:
            m += 1 if d[2] > ZERO else -1
        if not (0 <= i < n[0] and 0 <= j < n[1] and 0 <= m < n[2]):
            return mass, INFINITY


@part
def _to_grid(media, grid, a, w):
    """A point (w = 1) or a direction (w = 0) in the frame of a lattice."""
    x, y, z = row(media.grid_x, grid), row(media.grid_y, grid), row(media.grid_z, grid)
    shift = media.grid_shift
    return (
        x[0] * a[0] + x[1] * a[1] + x[2] * a[2] + w * shift[grid, 0],
        y[0] * a[0] + y[1] * a[1] + y[2] * a[2] + w * shift[grid, 1],
        z[0] * a[0] + z[1] * a[1] + z[2] * a[2] + w * shift[grid, 2],
    )


@part
def _clipped(o, d, n, start, end):
    """Between which distances a ray is inside of a lattice; the first is not below the second where it is not."""
    for axis in range(3):
        if d[axis] == ZERO:
            if o[axis] < ZERO or o[axis] > n[axis]:
                return end, start
            continue
        a, b = -o[axis] / d[axis], (np.float32(n[axis]) - o[axis]) / d[axis]
        start, end = max(start, min(a, b)), min(end, max(a, b))
    return start, end


@part
def _cell(a, n):
    """The number of a cell along an axis."""
    return min(max(int(a), 0), n - 1)


@part
def _leaves(o, d, i):
    """At which distance a ray leaves a cell along an axis."""
    if d == ZERO:
        return INFINITY
    return (np.float32(i + 1 if d > ZERO else i) - o) / d


@part
def _index(media, grid, i, j, m):
    """Where a cell of a lattice stands among all cells."""
    return media.first_cell[grid] + (np.int64(i) * media.n_cells[grid, 1] + j) * media.n_cells[grid, 2] + m
