"""Points spread evenly over the surfaces in a box."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..core.sampling.sequences import r2_sequence
from .scene import Scene

_CHUNK = 1 << 16  # triangles
_POINTS = 1 << 15  # in a chunk
_LONGEST = 16  # spacings, of an edge: what of larger triangles lies outside the box is cut off


@dataclass(frozen=True)
class SurfacePoints:
    """n points on surfaces.

    Attributes
    ----------
    position : (n, 3) float32, m
    triangle : (n,) int32
    area : float, m²
        What each point stands for.
    """

    position: np.ndarray
    triangle: np.ndarray
    area: float

    def where(self, chosen: np.ndarray) -> "SurfacePoints":
        """The points that a mask or an index array chooses."""
        return SurfacePoints(self.position[chosen], self.triangle[chosen], self.area)


def surface_points(scene: Scene, box: np.ndarray, spacing: float) -> Iterator[SurfacePoints]:
    """Yield points of the surfaces in a box (and just outside it), one for each `spacing`² of their area.

    Points follow each other along the surfaces at equal steps of area, and lie on their triangles by a low-discrepancy
    sequence; the same each time.

    Parameters
    ----------
    box : (2, 3) float32, m
        Lowest and highest corner.
    spacing : float, m
    """
    n_before = 0
    for start in range(0, scene.n_triangles, _CHUNK):
        triangle = np.arange(start, min(start + _CHUNK, scene.n_triangles), dtype=np.int32)
        corners, triangle = _pieces(scene.corners(triangle), triangle, box, _LONGEST * spacing)
        reached = np.cumsum(_areas(corners)) / spacing**2
        n = round(reached[-1]) if len(reached) else 0
        for k in (np.arange(i, min(i + _POINTS, n)) for i in range(0, n, _POINTS)):
            piece = np.minimum(np.searchsorted(reached, k + 0.5), len(reached) - 1)
            u, v = _folded(r2_sequence(n_before + k))
            weights = np.stack([1 - u - v, u, v], axis=1)
            yield SurfacePoints(np.einsum("nk,nki->ni", weights, corners[piece]), triangle[piece], spacing**2)
        n_before += n


def _pieces(
    corners: np.ndarray, triangle: np.ndarray, box: np.ndarray, longest: float
) -> tuple[np.ndarray, np.ndarray]:
    """Triangles cut in two at their longest edge until none is longer than `longest`, less those outside the box."""
    done: list[tuple[np.ndarray, np.ndarray]] = []
    while len(corners):
        inside = ((corners.max(axis=1) >= box[0]) & (corners.min(axis=1) <= box[1])).all(axis=1)
        corners, triangle = corners[inside], triangle[inside]
        edges = np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=2)
        short = edges.max(axis=1) <= longest
        done.append((corners[short], triangle[short]))
        corners, triangle, edge = corners[~short], triangle[~short], edges[~short].argmax(axis=1)
        row = np.arange(len(corners))
        a, b, c = (corners[row, (edge + i) % 3] for i in range(3))
        middle = (a + b) / 2
        corners = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
        triangle = np.concatenate([triangle, triangle])
    return np.concatenate([part for part, _ in done]), np.concatenate([part for _, part in done])


def _folded(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Barycentric weights of points of the unit square, whose upper half is folded down: what is even stays so."""
    u, v = np.where(points.sum(axis=1, keepdims=True) > 1, 1 - points, points).T
    return u, v


def _areas(corners: np.ndarray) -> np.ndarray:
    """Areas of triangles (n, 3, 3), (n,) float64, m²."""
    a, b, c = corners.astype(np.float64).transpose(1, 0, 2)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
