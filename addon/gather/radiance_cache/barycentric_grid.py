"""Triangles cut into n² equal cells by lines parallel to their edges.

Cell k lies in row i = ⌊nu⌋, column j = ⌊nv⌋ of the barycentric grid; a row holds 2(n−i)−1 cells, lower and upper ones
in turn, so that k = i(2n−i) + 2j + [upper]. Finding a cell is arithmetic, not a search. An upper cell is a lower one
turned by half a turn, so that either has barycentric coordinates (a, b) of its own.
"""

import numpy as np

from ...core.compiling import part
from ...core.vec3 import ONE


@part
def cell_at(n, u, v):
    """The cell k at barycentric coordinates (1−u−v, u, v) of a triangle cut n times, and the coordinates a, b in it."""
    if n == 1:
        return np.int32(0), u, v
    x, y = np.float64(u) * n, np.float64(v) * n
    i = min(max(np.int32(x), np.int32(0)), n - np.int32(1))
    j = min(max(np.int32(y), np.int32(0)), n - np.int32(1) - i)
    a, b = np.float32(x - i), np.float32(y - j)
    if a + b > ONE and i + j < n - 1:
        return np.int32(i * (2 * n - i) + 2 * j + 1), ONE - a, ONE - b
    return np.int32(i * (2 * n - i) + 2 * j), a, b


@part
def point_in(n, k, a, b):
    """Coordinates u, v on a triangle cut n times of the point a, b in its cell k, float32."""
    if n == 1:
        return a, b
    # The rows from i on hold (n−i)² cells, so i is the largest with (n−i)² ≥ n² − k.
    n, k = np.int64(n), np.int64(k)
    i = n - np.int64(np.ceil(np.sqrt(np.float64(n * n - k))))
    rest = k - i * (2 * n - i)
    if rest % 2 == 1:
        a, b = ONE - a, ONE - b
    return np.float32((i + a) / n), np.float32((rest // 2 + b) / n)
