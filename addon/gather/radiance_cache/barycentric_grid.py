"""Triangles cut into n² equal cells by lines parallel to their edges.

Cell k lies in row i = ⌊nu⌋, column j = ⌊nv⌋ of the barycentric grid; a row holds 2(n−i)−1 cells, lower and upper ones
in turn, so that k = i(2n−i) + 2j + [upper]. Finding a cell is arithmetic, not a search. An upper cell is a lower one
turned by half a turn, so that either has barycentric coordinates (a, b) of its own.
"""

import numpy as np


def cell_at(n: np.ndarray, u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The cell k at barycentric coordinates (1−u−v, u, v) of triangles cut n times, and the coordinates a, b in it."""
    x, y = u * n, v * n
    i = np.clip(x.astype(np.int32), 0, n - 1)
    j = np.clip(y.astype(np.int32), 0, n - 1 - i)
    a, b = (x - i).astype(np.float32), (y - j).astype(np.float32)
    upper = (a + b > 1) & (i + j < n - 1)
    return i * (2 * n - i) + 2 * j + upper, np.where(upper, 1 - a, a), np.where(upper, 1 - b, b)


def point_in(n: np.ndarray, k: np.ndarray, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates u, v on triangles cut n times of the points a, b in cells k, float32."""
    # The rows from i on hold (n−i)² cells, so i is the largest with (n−i)² ≥ n² − k.
    n, k = n.astype(np.int64), k.astype(np.int64)
    i = n - np.ceil(np.sqrt(n * n - k)).astype(np.int64)
    rest = k - i * (2 * n - i)
    j, upper = rest // 2, rest % 2 == 1
    u, v = (i + np.where(upper, 1 - a, a)) / n, (j + np.where(upper, 1 - b, b)) / n
    return u.astype(np.float32), v.astype(np.float32)
