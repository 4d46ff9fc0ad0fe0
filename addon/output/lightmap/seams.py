"""Seams: where charts meet in space and lie apart on the images."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ...receivers import Charts
from ...sampling.vectors import dot

_A_TEXEL = 2  # samples
_NEIGHBOURS = 12  # samples among which an edge's partners are looked for
_SAME_PLACE = 0.1  # texels
_SAME_NORMAL = float(np.cos(np.radians(10)))


@dataclass(frozen=True)
class Seams:
    """s pairs of places that are one place of the surface, on smooth seams.

    Attributes
    ----------
    image : (s, 2) int32
        Of the pair's two places.
    place : (s, 2, 2) float64
        Places, in texels from their image's corner, along u and v.
    """

    image: np.ndarray
    place: np.ndarray

    @staticmethod
    def none() -> "Seams":
        """No seams."""
        return Seams(np.zeros((0, 2), np.int32), np.zeros((0, 2, 2)))


@dataclass(frozen=True)
class _Edges:
    """The border edges of charts: ends (e, 2, …) in space, on the image (texels), and their shading normals."""

    image: np.ndarray
    position: np.ndarray
    place: np.ndarray
    normal: np.ndarray
    texel: np.ndarray  # side of a texel along the edge, m
    n_samples: np.ndarray

    @staticmethod
    def of(charts: Charts, sizes: tuple[tuple[int, int], ...]) -> "_Edges":
        triangle, corner = charts.border.T
        ends = np.stack([corner, (corner + 1) % 3], axis=1)
        image = charts.image[triangle]
        widths_heights = np.array(sizes, np.float64)[image, None, ::-1]
        position = charts.positions[triangle[:, None], ends].astype(np.float64)
        place = charts.uv[triangle[:, None], ends] * widths_heights
        length = np.linalg.norm(place[:, 1] - place[:, 0], axis=1)
        texel = np.linalg.norm(position[:, 1] - position[:, 0], axis=1) / np.maximum(length, 1e-9)
        n_samples = np.maximum(np.ceil(_A_TEXEL * length), 1).astype(np.int64)
        return _Edges(image, position, place, charts.normals[triangle[:, None], ends], texel, n_samples)

    def samples(self) -> tuple[np.ndarray, np.ndarray]:
        """Edge of each sample, and how far along it lies, evenly spaced."""
        edge = np.repeat(np.arange(len(self.image)), self.n_samples)
        first = np.cumsum(self.n_samples) - self.n_samples
        return edge, (np.arange(len(edge)) - first[edge] + 0.5) / self.n_samples[edge]


def seams_of(charts: Charts, sizes: tuple[tuple[int, int], ...]) -> Seams:
    """The seams of charts: samples of their borders that lie on another border with a normal alike.

    Parameters
    ----------
    sizes : tuple of (height, width)
        Of the images.
    """
    edges = _Edges.of(charts, sizes)
    edge, along = edges.samples()
    if len(edge) < 2:
        return Seams.none()
    position = _between(edges.position, edge, along)
    a, b = _edges_that_may_meet(edges, edge, position)
    # Every sample of the one edge against the other; pairs stand in both orders
    first = np.cumsum(edges.n_samples) - edges.n_samples
    pair = np.repeat(np.arange(len(a)), edges.n_samples[a])
    start = np.cumsum(edges.n_samples[a]) - edges.n_samples[a]
    sample = first[a[pair]] + np.arange(len(pair)) - start[pair]
    other = b[pair]
    along_other, distance = _nearest_on(edges, other, position[sample])
    normal = _between(edges.normal, edge[sample], along[sample])
    normal_other = _between(edges.normal, other, along_other)
    alike = dot(normal, normal_other) > _SAME_NORMAL * np.sqrt(dot(normal, normal) * dot(normal_other, normal_other))
    near = distance < _SAME_PLACE * np.minimum(edges.texel[edge[sample]], edges.texel[other])
    k = np.flatnonzero(alike & near)
    here, there = sample[k], other[k]
    places = _between(edges.place, edge[here], along[here]), _between(edges.place, there, along_other[k])
    return Seams(np.stack([edges.image[edge[here]], edges.image[there]], axis=1), np.stack(places, axis=1))


def _between(ends: np.ndarray, edge: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Values along edges, of values (e, 2, d) at their ends, (n, d)."""
    return ends[edge, 0] + along[:, None] * (ends[edge, 1] - ends[edge, 0])


def _edges_that_may_meet(edges: _Edges, edge: np.ndarray, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of edges that have samples close to each other, in both orders."""
    spacing = float((edges.texel / _A_TEXEL).max())
    distance, neighbour = cKDTree(position).query(position, _NEIGHBOURS, distance_upper_bound=spacing)
    k, column = np.nonzero(np.isfinite(distance))
    a, b = edge[k], edge[neighbour[k, column]]
    low, high = np.minimum(a, b)[a != b], np.maximum(a, b)[a != b]
    pairs = np.unique(low * len(edges.image) + high)
    low, high = np.divmod(pairs, len(edges.image))
    return np.concatenate([low, high]), np.concatenate([high, low])


def _nearest_on(edges: _Edges, edge: np.ndarray, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far along its edge the place next to each position (n, 3) lies, and their distance, (n,) each."""
    start, way = edges.position[edge, 0], edges.position[edge, 1] - edges.position[edge, 0]
    along = np.clip(dot(position - start, way) / np.maximum(dot(way, way), 1e-30), 0, 1)
    return along, np.linalg.norm(start + along[:, None] * way - position, axis=1)
