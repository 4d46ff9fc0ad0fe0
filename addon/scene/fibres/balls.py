"""Points as balls of triangles: octahedra, cut finer where there are few, in a bounded number of triangles.

By Cauchy's formula a convex body shows a quarter of its surface in the mean over all directions: a body with the
sphere's surface, 4πr², blocks as much light as it does. Turned at random, each by a turn of its own, it also scatters
the same in the mean.
"""

from dataclasses import dataclass

import numpy as np

MOST_TRIANGLES = 1_000_000
"""Of one object's points; where there would be more, there are fewer points, which are larger."""

FINE = 50_000
"""Triangles up to which octahedra are cut."""

MOST_POINTS = MOST_TRIANGLES // 8
SMOOTH, MOST_CUTS = 2, 3
"""Cuts from which on balls have smooth normals, and the most."""

_CORNERS = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]], float)
_FACES = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])


@dataclass(frozen=True)
class Balls:
    """Spheres, b of them, and how often the octahedra that stand for them are cut.

    Attributes
    ----------
    positions : (b, 3) float32
    radii : (b,) float32
    cuts : int
        Each makes four triangles of one.
    """

    positions: np.ndarray
    radii: np.ndarray
    cuts: int

    @staticmethod
    def of(positions: np.ndarray, radii: np.ndarray) -> "Balls":
        """Balls around those points that are finite and have a radius."""
        good = np.isfinite(positions).all(axis=1) & np.isfinite(radii) & (radii > 0)
        n = max(int(good.sum()), 1)
        cuts = next((cuts for cuts in range(MOST_CUTS, 0, -1) if n * 8 * 4**cuts <= FINE), 0)
        return Balls(positions[good], radii[good], cuts)

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def n_vertices(self) -> int:
        return len(self) * len(octahedron(self.cuts)[0])

    @property
    def n_triangles(self) -> int:
        return len(self) * 8 * 4**self.cuts

    def triangles(self) -> np.ndarray:
        """Vertices of the triangles, whose normals point outward, (t, 3) int32."""
        vertices, faces = octahedron(self.cuts)
        first = len(vertices) * np.arange(len(self), dtype=np.int32)
        return (first[:, None, None] + faces.astype(np.int32)).reshape(-1, 3)

    def outward(self) -> np.ndarray:
        """Unit vectors from the balls' middles to their vertices, (v, 3) float32."""
        turns = _turns(len(self))
        return np.einsum("bij,vj->bvi", turns, octahedron(self.cuts)[0]).reshape(-1, 3).astype(np.float32)

    def vertices(self, outward: np.ndarray) -> np.ndarray:
        """Vertices, (v, 3) float32, at such a distance that each ball has its sphere's surface."""
        n = len(octahedron(self.cuts)[0])
        radii = np.repeat(self.radii * np.float32(swelling(self.cuts)), n)
        return np.repeat(self.positions, n, axis=0) + radii[:, None] * outward


def octahedron(cuts: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices on the unit sphere (v, 3), and faces (f, 3), of an octahedron whose faces are cut so many times."""
    vertices, faces = _CORNERS, _FACES
    for _ in range(cuts):
        edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        distinct, edge = np.unique(edges, axis=0, return_inverse=True)
        middles = vertices[distinct].sum(axis=1)
        a, b, c = faces.T
        ab, bc, ca = (len(vertices) + edge.reshape(-1, 3)).T
        faces = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3)
        vertices = np.concatenate([vertices, middles / np.linalg.norm(middles, axis=1, keepdims=True)])
    return vertices, faces


def swelling(cuts: int) -> float:
    """How many times its sphere's radius an octahedron's has to be for the same surface."""
    vertices, faces = octahedron(cuts)
    a, b, c = vertices[faces].transpose(1, 0, 2)
    return float(np.sqrt(8 * np.pi / np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()))


def _turns(n: int) -> np.ndarray:
    """Random rotations, (n, 3, 3): those of quaternions that are uniform on their sphere."""
    q = np.random.default_rng(2).normal(size=(n, 4))
    w, x, y, z = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)
