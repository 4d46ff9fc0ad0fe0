"""One point of the surface for what a patch covers of a texel."""

from dataclasses import dataclass

import numpy as np

from ...core.sampling.vectors import dot, largest, rows
from ...scene.scene import interpolate
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

    def where(self, chosen: np.ndarray) -> "TexelPoints":
        """The points that a mask or an index array chooses."""
        return TexelPoints(*(rows(getattr(self, name), chosen) for name in self.__dataclass_fields__))

    @staticmethod
    def join(parts: "list[TexelPoints]") -> "TexelPoints":
        """All points of several `TexelPoints`, in order."""
        return TexelPoints(
            *(np.concatenate([getattr(part, name) for part in parts]) for name in TexelPoints.__dataclass_fields__)
        )


def points_of(
    charts: Charts, corners: np.ndarray, fragments: Fragments, texel: np.ndarray, n: int = 1
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
    _, group = np.unique(key, return_inverse=True)
    share = np.bincount(group, fragments.area)
    sums = [np.bincount(group, fragments.area * fragments.middle[:, i]) for i in range(2)]
    mean = np.stack(sums, axis=1) / share[:, None]
    depth = np.minimum.reduce(_barycentrics(rows(corners, fragments.triangle), rows(mean, group)))
    order = np.lexsort([-depth, group])
    chosen = order[np.searchsorted(group[order], np.arange(len(share)))]
    triangle = fragments.triangle[chosen]
    place = np.where((depth[chosen] >= -1e-9)[:, None], mean, rows(fragments.middle, chosen))
    partly = np.flatnonzero(share < (1 - 1e-6) / n**2)
    place[partly] = _pulled(rows(corners, triangle[partly]), rows(place, partly))
    across = _across(charts, corners)
    area = np.linalg.norm(np.cross(across[:, 0], across[:, 1]), axis=1)[fragments.triangle] * fragments.area
    radius = np.sqrt(np.bincount(group, area) / np.pi)
    position, normal = _on_surface(charts, corners, triangle, place, radius)
    points = TexelPoints(
        texel[chosen], triangle, share, place, position, normal, rows(across, triangle), radius.astype(np.float32)
    )
    return points, group


def _barycentrics(corners: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Barycentric weights (n,) of places (n, 2) on triangles (n, 3, 2)."""
    x, y = corners.transpose(2, 1, 0)
    ax, ay, bx, by = x[1] - x[0], y[1] - y[0], x[2] - x[0], y[2] - y[0]
    px, py = place[:, 0] - x[0], place[:, 1] - y[0]
    area = ax * by - ay * bx
    u, v = (px * by - py * bx) / area, (ax * py - ay * px) / area
    return 1 - u - v, u, v


def _pulled(corners: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Places (n, 2) moved by `EDGE_PULL` to the middle of their triangles (n, 3, 2), but not beyond it."""
    way = corners.mean(axis=1) - place
    length = np.linalg.norm(way, axis=1, keepdims=True)
    return place + way * np.minimum(EDGE_PULL / np.maximum(length, 1e-30), 1)


def _across(charts: Charts, corners: np.ndarray) -> np.ndarray:
    """Way along each triangle from texel to texel, to the next column and to the next row, (t, 2, 3) float32, m."""
    places = corners[:, 1:] - corners[:, :1]
    ways = (charts.positions[:, 1:] - charts.positions[:, :1]).astype(np.float64)
    area = places[:, 0, 0] * places[:, 1, 1] - places[:, 0, 1] * places[:, 1, 0]
    inverse = np.stack([places[:, 1, 1], -places[:, 0, 1], -places[:, 1, 0], places[:, 0, 0]], axis=1)
    inverse = inverse.reshape(-1, 2, 2) / np.where(area == 0, np.inf, area)[:, None, None]
    return (inverse @ ways).astype(np.float32)


def _on_surface(
    charts: Charts, corners: np.ndarray, triangle: np.ndarray, place: np.ndarray, radius: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Lifted positions and unit shading normals of places (n, 2) on triangles, (n, 3) float32 each."""
    _, u, v = _barycentrics(rows(corners, triangle), place)
    corner = charts.positions.astype(np.float64)
    position = interpolate(rows(corner, triangle), u, v)
    flat = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-30)
    flat = rows(flat, triangle)
    normal = interpolate(rows(charts.normals.astype(np.float64), triangle), u, v)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.where(length > 1e-3, normal / np.maximum(length, 1e-30), flat)
    lift = np.maximum(LIFT * radius, LEAST_LIFT * largest(np.abs(position)))[:, None]
    lifted = position + np.where(dot(flat, normal)[:, None] < 0, -lift, lift) * flat
    return lifted.astype(np.float32), normal.astype(np.float32)
