"""One point of the surface for what a patch covers of a texel."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core.compiling import kernel, kernel_array, part
from ...core.parallel import Workers, slices
from ...core.sampling.vectors import rows
from ...core.vec3 import along, cross, dot, length, minus, plus, put, row, times, wide
from .charts import Charts
from .coverage import Fragments

LIFT = 1e-3
"""How far a receiver is lifted off its surface, as a share of its texel's radius there."""

LEAST_LIFT = 2.0**-17
"""The least lift, as a share of the largest coordinate: some units in the last place of a float32."""

EDGE_PULL = 0.02
"""How far, in texels, a point of a texel that is covered in part is pulled to the middle of its triangle.

What a chart touches just so has its point on the chart's very edge, where other surfaces often start.
"""


_ON_EDGE = -1e-9  # barycentric weight
_CHUNK = 1 << 15  # points


@dataclass(frozen=True)
class TexelPoints:
    """n points of charts, each for what a patch covers of a texel (or of a cell of one).

    Attributes
    ----------
    texel : (n,) int64
        Counted over all images.
    triangle : (n,) int32
    share : (n,) float64
        What the patch covers of the texel.
    place : (n, 2) float64
        Texels from the image's corner, along u and v.
    position, normal : (n, 3) float32
        Lifted off the surface, m; unit shading normal.
    across : (n, 2, 3) float32, m
        Way along the surface from texel to texel, to the next column and to the next row.
    footprint : (n,) float32, m
        Radius of a disc as large as what the point stands for.
    """

    texel: np.ndarray
    triangle: np.ndarray
    share: np.ndarray
    place: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    across: np.ndarray
    footprint: np.ndarray

    def __len__(self) -> int:
        return len(self.texel)

    @staticmethod
    def room(n: int) -> "TexelPoints":
        """Room for n points."""
        position, normal = np.empty((2, n, 3), np.float32)
        numbers = np.empty(n, np.int64), np.empty(n, np.int32), np.empty(n), np.empty((n, 2))
        return TexelPoints(*numbers, position, normal, np.empty((n, 2, 3), np.float32), np.empty(n, np.float32))

    def where(self, chosen: np.ndarray | slice) -> "TexelPoints":
        """The points that a mask or an index array chooses, or a view of those of a slice."""
        if isinstance(chosen, slice):
            return TexelPoints(*(getattr(self, name)[chosen] for name in self.__dataclass_fields__))
        return TexelPoints(*(rows(getattr(self, name), chosen) for name in self.__dataclass_fields__))

    @staticmethod
    def join(parts: "list[TexelPoints]") -> "TexelPoints":
        """All points of several `TexelPoints`, in order."""
        return TexelPoints(
            *(np.concatenate([getattr(part, name) for part in parts]) for name in TexelPoints.__dataclass_fields__)
        )


def points_of(
    charts: Charts, corners: np.ndarray, fragments: Fragments, texel: np.ndarray, workers: Workers, n: int = 1
) -> tuple[TexelPoints, np.ndarray]:
    """The points of fragments, and which point each fragment went to, (f,) int64.

    A point lies at the mean place, by area, of what its patch covers. Where that is off the patch, as in the bend of a
    chart, it lies in the middle of a fragment.

    Parameters
    ----------
    corners : (t, 3, 2) float64
        Of the charts' triangles, in texels.
    texel : (f,) int64
        Of each fragment, counted over all images.
    n : int
        Texels are cut into n × n cells.
    """
    patch = charts.patch[fragments.triangle].astype(np.int64)
    key = (texel * n * n + fragments.cell) * (patch.max(initial=0) + 1) + patch
    order = np.argsort(key, kind="stable")
    key = key[order]
    first = np.flatnonzero(np.diff(key, prepend=-1))
    ends = np.append(first[1:], len(key))
    group = np.empty(len(key), np.int64)
    group[order] = np.repeat(np.arange(len(first)), ends - first)
    points = TexelPoints.room(len(first))
    points.texel[:] = texel[order[first]]
    positions, normals = (kernel_array(of, np.float32) for of in (charts.positions, charts.normals))
    surface = Surface(positions, normals, kernel_array(corners, np.float64))

    def fill(chunk: slice) -> None:
        some = points.where(chunk)
        arrays = some.triangle, some.share, some.place, some.position, some.normal, some.across, some.footprint
        find_points(surface, fragments, order, first[chunk], ends[chunk], (1 - 1e-6) / n**2, arrays)

    for _ in workers.map(fill, slices(len(first), _CHUNK)):
        workers.progress.check()
    return points, group


class Surface(NamedTuple):
    """Triangles for kernels: corners (t, 3, 3) float32, m, their normals, and places (t, 3, 2) float64, texels."""

    positions: np.ndarray
    normals: np.ndarray
    corners: np.ndarray


@kernel
def find_points(surface, fragments, order, first, ends, whole, points):
    """The points of groups of fragments.

    Parameters
    ----------
    order : (f,) int64
        The fragments, group after group; those of a group from its `first` to its end.
    whole : float
        Share of a texel that is covered wholly.
    points : tuple of arrays
        Of `TexelPoints` less its texels.
    """
    for k in range(len(first)):
        _find_point(surface, fragments, order[first[k] : ends[k]], whole, points, k)


@part
def _find_point(surface, fragments, members, whole, points, k):
    """The k-th point, of what the member fragments cover together."""
    triangles, shares, places, positions, normals, acrosses, footprints = points
    share = u = v = area = 0.0
    for f in members:
        covered = fragments.area[f]
        share += covered
        u, v = u + covered * fragments.middle[f, 0], v + covered * fragments.middle[f, 1]
        across_u, across_v = _across(surface, fragments.triangle[f])
        area += covered * length(cross(across_u, across_v))
    u, v = u / share, v / share
    chosen, deepest = members[0], -np.inf
    for f in members:
        b0, b1, b2 = _barycentrics(surface.corners[fragments.triangle[f]], u, v)
        depth = min(b0, min(b1, b2))
        if depth > deepest:
            chosen, deepest = f, depth
    if not deepest >= _ON_EDGE:
        u, v = fragments.middle[chosen, 0], fragments.middle[chosen, 1]
    t = fragments.triangle[chosen]
    if share < whole:
        u, v = _pulled(surface.corners[t], u, v)
    radius = np.sqrt(area / np.pi)
    position, normal = _on_surface(surface, t, u, v, radius)
    across_u, across_v = _across(surface, t)
    triangles[k], shares[k], places[k, 0], places[k, 1], footprints[k] = t, share, u, v, radius
    put(positions, k, position)
    put(normals, k, normal)
    put(acrosses[k], 0, across_u)
    put(acrosses[k], 1, across_v)


@part
def _barycentrics(corners, u, v):
    """Barycentric weights of a place on a triangle (3, 2)."""
    ax, ay, bx, by = _sides(corners)
    px, py = u - corners[0, 0], v - corners[0, 1]
    area = ax * by - ay * bx
    b, c = (px * by - py * bx) / area, (ax * py - ay * px) / area
    return 1 - b - c, b, c


@part
def _sides(corners):
    """The two sides of a triangle (3, 2) from its first corner."""
    x, y = corners[0, 0], corners[0, 1]
    return corners[1, 0] - x, corners[1, 1] - y, corners[2, 0] - x, corners[2, 1] - y


@part
def _pulled(corners, u, v):
    """A place moved by `EDGE_PULL` to the middle of its triangle (3, 2), but not beyond it."""
    x = (corners[0, 0] + corners[1, 0] + corners[2, 0]) / 3 - u
    y = (corners[0, 1] + corners[1, 1] + corners[2, 1]) / 3 - v
    share = min(EDGE_PULL / max(np.sqrt(x * x + y * y), 1e-30), 1.0)
    return u + share * x, v + share * y


@part
def _corner(surface, triangle, k):
    """A corner in space, float64."""
    return wide(row(surface.positions[triangle], k))


@part
def _across(surface, triangle):
    """Way along a triangle from texel to texel, to the next column and to the next row, float64, m."""
    ax, ay, bx, by = _sides(surface.corners[triangle])
    first = _corner(surface, triangle, 0)
    a, b = minus(_corner(surface, triangle, 1), first), minus(_corner(surface, triangle, 2), first)
    area = ax * by - ay * bx
    per = 0.0 if area == 0 else 1 / area
    return minus(times(a, by * per), times(b, ay * per)), minus(times(b, ax * per), times(a, bx * per))


@part
def _on_surface(surface, triangle, u, v, radius):
    """Lifted position and unit shading normal of a place on a triangle."""
    b0, b1, b2 = _barycentrics(surface.corners[triangle], u, v)
    p0, p1, p2 = _corner(surface, triangle, 0), _corner(surface, triangle, 1), _corner(surface, triangle, 2)
    position = plus(plus(times(p0, b0), times(p1, b1)), times(p2, b2))
    flat = cross(minus(p1, p0), minus(p2, p0))
    flat = times(flat, 1 / max(length(flat), 1e-30))
    normals = surface.normals[triangle]
    normal = plus(
        plus(times(wide(row(normals, 0)), b0), times(wide(row(normals, 1)), b1)), times(wide(row(normals, 2)), b2)
    )
    size = length(normal)
    normal = times(normal, 1 / size) if size > 1e-3 else flat
    reach = max(abs(position[0]), max(abs(position[1]), abs(position[2])))
    lift = max(LIFT * radius, LEAST_LIFT * reach)
    return along(position, -lift if dot(flat, normal) < 0 else lift, flat), normal
