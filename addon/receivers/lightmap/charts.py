"""Meshes with a place in a lightmap, and their charts: triangles that hang together in space and in UV."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...core.progress import Progress
from ...core.sampling.vectors import dot

_SMOOTH = float(np.cos(np.radians(30)))
_UV_STEPS = 1 << 16  # along an image: corners closer than that are one


@dataclass(frozen=True)
class LightmapMesh:
    """An object that has a place in a lightmap: t triangles.

    Attributes
    ----------
    object_name : str
        For messages.
    image : int
        Which image its light goes to.
    positions : (t, 3, 3) float32, m
        Of the triangles' corners, world space.
    normals : (t, 3, 3) float32
        Unit shading normals of the corners, world space.
    uv : (t, 3, 2) float32
        Of the corners in that image, each in [0, 1]: already moved to the object's place in the atlas.
    """

    object_name: str
    image: int
    positions: np.ndarray
    normals: np.ndarray
    uv: np.ndarray


@dataclass(frozen=True)
class Charts:
    """The triangles of several meshes, t in all, and how they hang together.

    Attributes
    ----------
    mesh, image : (t,) int32
        Which mesh and which image each triangle is of.
    positions, normals, uv
        As in `LightmapMesh`.
    chart : (t,) int32
        Chart of each triangle, from 0: triangles of a mesh that share edges, in space and in UV at once.
    patch : (t,) int32
        Patch of each triangle, from 0: the parts that sharp edges cut a chart into, where the normals of an edge's
        two sides differ by over 30°.
    border : (b, 2) int32
        Triangle and first corner of each edge that no other triangle of the chart shares.
    """

    mesh: np.ndarray
    image: np.ndarray
    positions: np.ndarray
    normals: np.ndarray
    uv: np.ndarray
    chart: np.ndarray
    patch: np.ndarray
    border: np.ndarray

    @property
    def n_charts(self) -> int:
        return int(self.chart.max(initial=-1)) + 1

    @staticmethod
    def of(meshes: Sequence[LightmapMesh], progress: Progress | None = None) -> "Charts":
        """The charts of meshes."""
        check = (progress or Progress()).check
        counts = [len(mesh.positions) for mesh in meshes]
        mesh = np.repeat(np.arange(len(meshes), dtype=np.int32), counts)
        image = np.array([one.image for one in meshes], np.int32)[mesh]
        positions, normals = (_joined(meshes, name, 3) for name in ("positions", "normals"))
        uv = _joined(meshes, "uv", 2)
        n = len(image)
        corner = _corner_numbers(positions, uv, mesh, check).reshape(n, 3)
        start, end = corner, corner[:, [1, 2, 0]]
        edge = (np.minimum(start, end) * (3 * n) + np.maximum(start, end)).reshape(-1)
        _, edge, count = np.unique(edge, return_inverse=True, return_counts=True)
        check()
        order = np.argsort(edge, kind="stable")
        follows = edge[order[1:]] == edge[order[:-1]]
        a, b = order[:-1][follows], order[1:][follows]  # the two sides of an edge, as triangle · 3 + corner
        smooth = _smooth(normals, corner, a, b)
        check()
        chart = components(n, a // 3, b // 3)
        patch = components(n, a[smooth] // 3, b[smooth] // 3)
        border = np.stack(np.divmod(np.flatnonzero(count[edge] == 1), 3), axis=1).astype(np.int32)
        return Charts(mesh, image, positions, normals, uv, chart, patch, border)


def _joined(meshes: Sequence[LightmapMesh], name: str, n: int) -> np.ndarray:
    """An array (t, 3, n) of all meshes."""
    return np.concatenate([np.zeros((0, 3, n), np.float32), *(getattr(mesh, name) for mesh in meshes)])


def _corner_numbers(positions: np.ndarray, uv: np.ndarray, mesh: np.ndarray, check: Callable[[], None]) -> np.ndarray:
    """A number for each triangle corner, the same for corners of a mesh (t,) that share a place in space and in UV."""
    x, y, z = np.moveaxis(positions.astype(np.float32) + np.float32(0), 2, 0).reshape(3, -1).view(np.uint32)
    u, v = np.moveaxis(np.rint(uv * _UV_STEPS).astype(np.int32), 2, 0).reshape(2, -1).view(np.uint32)
    columns = [(x, y), (z, np.repeat(mesh, 3).astype(np.uint32)), (u, v)]
    number = np.zeros(len(x), np.int64)
    for high, low in columns:
        check()
        _, both = np.unique(high.astype(np.uint64) << np.uint64(32) | low, return_inverse=True)
        _, number = np.unique(number * (both.max(initial=0) + 1) + both, return_inverse=True)
    return number


def _smooth(normals: np.ndarray, corner: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Whether normals agree along edges that triangle corners `a` and `b` start, (e,) bool."""

    def ends(k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        triangle, first = np.divmod(k, 3)
        second = (first + 1) % 3
        swapped = corner[triangle, first] > corner[triangle, second]
        return (
            normals[triangle, np.where(swapped, second, first)],
            normals[triangle, np.where(swapped, first, second)],
        )

    (a_low, a_high), (b_low, b_high) = ends(a), ends(b)
    return (dot(a_low, b_low) > _SMOOTH) & (dot(a_high, b_high) > _SMOOTH)


def components(n: int, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Number of the connected set of each of n things, a pair (a, b) being connected, (n,) int32."""
    # Here, since Blender's start imports this room and should not wait for SciPy
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    links = coo_array((np.ones(len(a), np.int8), (a, b)), shape=(n, n))
    return connected_components(links, directed=False)[1]
