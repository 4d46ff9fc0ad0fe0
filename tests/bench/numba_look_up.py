"""The cache look-up of gather rays and their sums as compiled code: the arithmetic of `RadianceCache.look_up`."""

import numpy as np
from numba import njit


@njit(nogil=True, cache=True)
def cell_at(n, u, v):
    """See `barycentric_grid.cell_at`; NumPy multiplies float32 with int32 in float64, too."""
    x, y = np.float64(u) * n, np.float64(v) * n
    i = min(max(np.int32(x), 0), n - 1)
    j = min(max(np.int32(y), 0), n - 1 - i)
    a, b = np.float32(x - i), np.float32(y - j)
    upper = a + b > np.float32(1) and i + j < n - 1
    if upper:
        return i * (2 * n - i) + 2 * j + 1, np.float32(1) - a, np.float32(1) - b
    return i * (2 * n - i) + 2 * j, a, b


@njit(nogil=True, cache=True)
def sums_of_records(rays, surfaces, cells, elements, radiance, reach, n_rays):
    """Radiance that every run of `n_rays` rays meets far enough away, summed, (r, 3) float64; and which end too near.

    Parameters
    ----------
    rays : tuple
        directions (n, 3), triangle, distance, u, v (n,): what Embree was asked and what it said; triangle −1 if nothing
    surfaces : (t, 3) float32
        Normals of triangles.
    cells, elements : tuple
        cuts and first of `SurfaceCells` (t,) and of `SurfaceElements` (c,).
    radiance, reach : (2 e + 2, 3), (e + 1,) float32
        Of the cache.
    """
    directions, triangle, distance, u, v = rays
    sums, near = np.zeros((len(triangle) // n_rays, 3)), np.zeros(len(triangle), np.bool_)
    for k in range(len(triangle)):
        t = triangle[k]
        if t < 0:
            continue
        nth, a, b = cell_at(cells[0][t], u[k], v[k])
        cell = cells[1][t] + nth
        nth, a, b = cell_at(elements[0][cell], a, b)
        element = elements[1][cell] + nth
        near[k] = distance[k] < reach[element]
        if not near[k]:
            normal, way = surfaces[t], directions[k]
            back = normal[0] * way[0] + normal[1] * way[1] + normal[2] * way[2] > 0
            for channel in range(3):
                sums[k // n_rays, channel] += radiance[2 * element + back, channel]
    return sums, near
