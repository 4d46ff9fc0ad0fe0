"""Charts seen along their normals, and which of their faces lie over others there."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...core.sampling.vectors import dot
from ...core.sampling.warps import frame
from ..lightmap.coverage import middles_in
from .faces import Faces
from .outlines import from_zero

_TEXELS_OF_FACE = 48  # in which a mesh's charts are looked at
_LEAST, _MOST = 1 << 12, 1 << 21  # of these, for a mesh
_ACROSS = 12.0  # texels that a chart spans, at least
_NUMBERS = 1 << 26  # texels in all charts' boxes, at most


@dataclass(frozen=True)
class Projection:
    """Faces as seen along their chart's normal.

    Attributes
    ----------
    chart : (f,) int32
    uv : (c, 2) float32, m
        Of the corners, in their chart's plane.
    height : (f,) float64, m
        Of the faces' middles above it.
    cosine : (f,) float64
        Of the angle between a face and it.
    """

    chart: np.ndarray
    uv: np.ndarray
    height: np.ndarray
    cosine: np.ndarray

    @staticmethod
    def of(faces: Faces, chart: np.ndarray, normals: np.ndarray, steep: float) -> "Projection":
        """Faces seen along the mean normal of their chart (f,), or if that is steeper than `steep` to one, its middle.

        Parameters
        ----------
        normals : (f, 3) float64
            Of the faces; 0 where they have no area.
        """
        n = int(chart.max(initial=-1)) + 1
        mean = np.stack([np.bincount(chart, column, n) for column in faces.vector_areas.T], axis=1)
        mean = _unit(mean)
        has_area = dot(normals, normals) > 0
        least = np.ones(n)
        np.minimum.at(least, chart[has_area], dot(normals, mean[chart])[has_area])
        # The axis of the smallest cone about the normals lies near the mean of the two that are farthest apart
        middle = _unit(mean + _steepest(normals, chart, mean, has_area, n))
        mean = np.where((least < steep)[:, None], middle, mean)
        across, up = frame(mean)
        position = faces.positions[faces.corner_vertex].astype(np.float64)
        of_corner = chart[faces.face_of_corner]
        uv = np.stack([dot(position, across[of_corner]), dot(position, up[of_corner])], axis=1)
        height = np.bincount(faces.face_of_corner, dot(position, mean[of_corner]), len(faces)) / faces.n_corners
        uv, _ = from_zero(uv, of_corner, n)  # where float32 is exact
        return Projection(chart, uv.astype(np.float32), height, np.abs(dot(normals, mean[chart])))


def _steepest(normals: np.ndarray, chart: np.ndarray, mean: np.ndarray, has_area: np.ndarray, n: int) -> np.ndarray:
    """The normal of each chart that is farthest from its mean normal, (n, 3)."""
    order = np.lexsort([-dot(normals, mean[chart]), chart])
    order = order[has_area[order]]
    last = np.flatnonzero(np.append(np.diff(chart[order]) != 0, True)) if len(order) else order
    steepest = np.zeros((n, 3))
    steepest[chart[order[last]]] = normals[order[last]]
    return steepest


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors (n, 3) of length 1; (0, 0, 1) for those without a length."""
    length = np.sqrt(dot(vectors, vectors))[:, None]
    return np.where(length > 0, vectors / np.where(length > 0, length, 1), (0.0, 0.0, 1.0))


def faces_above(faces: Faces, seen: Projection, doubtful: np.ndarray, check: Callable[[], None]) -> np.ndarray:
    """Which of the faces that a mask (f,) names lie over others of their chart at the middle of a texel, (f,) bool."""
    n = int(seen.chart.max(initial=-1)) + 1
    several = np.bincount(seen.chart, minlength=n) > 1
    triangle = np.flatnonzero((several[seen.chart] & doubtful)[faces.face_of_triangle])
    above = np.zeros(len(faces), bool)
    if not len(triangle):
        return above
    chart = seen.chart[faces.face_of_triangle[triangle]]
    corners = seen.uv[faces.triangles[triangle]].astype(np.float64)
    width, first = _grids(corners, chart, n)
    corners *= width[1][chart][:, None, None]
    texels, owners = [], []
    for k, place in middles_in(corners):
        check()
        texels.append(first[chart[k]] + place[:, 1].astype(np.int64) * width[0][chart[k]] + place[:, 0])
        owners.append(faces.face_of_triangle[triangle[k]])
    if not texels:
        return above
    texel, owner = np.concatenate(texels), np.concatenate(owners)
    order = np.argsort(texel, kind="stable")
    check()
    texel, owner = texel[order], owner[order]
    beside = (texel[1:] == texel[:-1]) & (owner[1:] != owner[:-1])
    a, b = owner[:-1][beside], owner[1:][beside]
    first_is_higher = (seen.height[a] > seen.height[b]) | ((seen.height[a] == seen.height[b]) & (a > b))
    above[np.where(first_is_higher, a, b)] = True
    return above


def _grids(corners: np.ndarray, chart: np.ndarray, n: int) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
    """For each chart a grid: its width in texels and texels a metre; and its first texel's number, (n,) each."""
    extent = np.zeros((n, 2))
    for axis in range(2):
        np.maximum.at(extent[:, axis], chart, corners[..., axis].max(axis=1))
    area = float((extent[:, 0] * extent[:, 1]).sum())
    density = np.sqrt(np.clip(_TEXELS_OF_FACE * len(corners), _LEAST, _MOST) / area) if area > 0 else 1.0
    longest = np.maximum(extent.max(axis=1), 1e-30)
    density = np.maximum(density, _ACROSS / longest)
    size = np.floor(extent * density[:, None]).astype(np.int64) + 2
    if (total := float(size.prod(axis=1).sum())) > _NUMBERS:
        density = density * np.sqrt(_NUMBERS / total)
        size = np.floor(extent * density[:, None]).astype(np.int64) + 2
    count = size.prod(axis=1)
    return (size[:, 0], density), np.cumsum(count) - count
