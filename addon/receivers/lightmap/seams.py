"""Seams: where charts meet in space and lie apart on their images."""

from dataclasses import dataclass

import numpy as np

from ...core.parallel import slices
from ...core.progress import Progress
from ...core.ranges import unrolled
from ...core.sampling.vectors import dot, rows
from ...tracing import Tracer
from .charts import Charts

_STAGE = "Looking for seams"
_CHUNK = 1 << 16  # samples
_A_TEXEL = 2  # samples
_NEIGHBOURS = 12  # samples among which an edge's partners are looked for
_SAME_PLACE = 0.1  # texels
_SAME_NORMAL = float(np.cos(np.radians(10)))
_ASIDE = 0.1  # texels from a seam, to both of its sides and up, where it is seen whether another surface parts them
_SHORTEST = 1e-3  # texels
_FOLDED_BACK = float(np.radians(135))  # two sheets that lie on each other; no surface goes on there


@dataclass(frozen=True)
class Seams:
    """s pairs of places that are one place of the surface, on smooth seams.

    Attributes
    ----------
    image : (s, 2) int32
        Of the pair's two places.
    place : (s, 2, 2) float64
        Places, in texels from their image's corner, along u and v.
    fold : (s,) float64, radians
        How far the faces turn there, whose normals are smooth all the same; 0 where they go on flat.
    """

    image: np.ndarray
    place: np.ndarray
    fold: np.ndarray

    @staticmethod
    def none() -> "Seams":
        """No seams."""
        return Seams(np.zeros((0, 2), np.int32), np.zeros((0, 2, 2)), np.zeros(0))


@dataclass(frozen=True)
class _Edges:
    """The border edges of charts.

    Attributes
    ----------
    image : (e,) int32
    position, normal, place : (e, 2, …)
        Of their ends: in space, m; shading normals; on the image, texels.
    inwards : (e, 3)
        Unit vectors along the surface, into the chart.
    texel : (e,), m
        Side of a texel along the edge.
    n_samples : (e,) int64
    """

    image: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    place: np.ndarray
    inwards: np.ndarray
    texel: np.ndarray
    n_samples: np.ndarray

    @staticmethod
    def of(charts: Charts, sizes: tuple[tuple[int, int], ...]) -> "_Edges":
        """The border edges that are longer than a point on the image."""
        triangle, corner = charts.border.T
        ends = np.stack([corner, (corner + 1) % 3], axis=1)
        widths_heights = np.array(sizes, np.float64).reshape(-1, 2)[charts.image[triangle], None, ::-1]
        place = charts.uv[triangle[:, None], ends] * widths_heights
        length = np.linalg.norm(place[:, 1] - place[:, 0], axis=1)
        k = np.flatnonzero(length > _SHORTEST)
        triangle, ends, place, length = triangle[k], ends[k], place[k], length[k]
        position = charts.positions[triangle[:, None], ends].astype(np.float64)
        along = _unit(position[:, 1] - position[:, 0])
        aside = charts.positions[triangle].mean(axis=1) - position[:, 0]
        inwards = _unit(aside - dot(aside, along)[:, None] * along)
        texel = np.linalg.norm(position[:, 1] - position[:, 0], axis=1) / length
        n_samples = np.ceil(_A_TEXEL * length).astype(np.int64)
        normal = charts.normals[triangle[:, None], ends]
        return _Edges(charts.image[triangle], position, normal, place, inwards, texel, n_samples)

    def __len__(self) -> int:
        return len(self.image)

    def samples(self) -> tuple[np.ndarray, np.ndarray]:
        """Edge of each sample, and how far along it lies, evenly spaced."""
        edge, nth = unrolled(self.n_samples)
        return edge, (nth + 0.5) / self.n_samples[edge]

    def folds(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """How far the surface turns from edges a to edges b, (n,) float64, radians."""
        return np.pi - np.arccos(np.clip(dot(rows(self.inwards, a), rows(self.inwards, b)), -1, 1))

    def meet(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Whether an end of one edge lies on the other, as it does where edges run along each other, (n,) bool."""
        near = _SAME_PLACE * np.minimum(self.texel[a], self.texel[b])
        met = np.zeros(len(a), bool)
        for one, other in ((a, b), (b, a)):
            for end in range(2):
                met |= self.nearest(other, self.position[one, end])[1] < near
        return met & (self.folds(a, b) < _FOLDED_BACK)

    def nearest(self, edge: np.ndarray, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How far along its edge the place next to each position (n, 3) lies, and their distance, (n,) each."""
        start, end = np.moveaxis(rows(self.position, edge), 1, 0)
        way = end - start
        along = np.clip(dot(position - start, way) / np.maximum(dot(way, way), 1e-30), 0, 1)
        off = start + along[:, None] * way - position
        return along, np.sqrt(dot(off, off))


def seams_of(
    charts: Charts,
    sizes: tuple[tuple[int, int], ...],
    tracer: Tracer | None = None,
    progress: Progress | None = None,
) -> Seams:
    """The seams of charts: samples of their borders that lie on another border with a normal alike.

    Parameters
    ----------
    sizes : tuple of (height, width)
        Of the images.
    tracer : Tracer, optional
        Leaves out where another surface stands on the seam, as a floor that parts a wall: light may jump there.
    """
    progress = progress or Progress()
    edges = _Edges.of(charts, sizes)
    edge, along = edges.samples()
    if len(edge) < 2:
        return Seams.none()
    position = _between(edges.position, edge, along)
    sample, other = _pairs(edges, edge, position, progress)
    found = [Seams.none()]
    for chunk in slices(len(sample), _CHUNK):
        progress.update(_STAGE, 0.5 + 0.5 * chunk.start / len(sample))
        some = sample[chunk]
        found.append(_seams(edges, edge[some], along[some], position[some], other[chunk], tracer))
    return Seams(*(np.concatenate([getattr(part, name) for part in found]) for name in Seams.__dataclass_fields__))


def _seams(
    edges: _Edges, edge: np.ndarray, along: np.ndarray, position: np.ndarray, other: np.ndarray, tracer: Tracer | None
) -> Seams:
    """Seams among samples of edges (n,) and the edges that they may lie on, (n,)."""
    along_other, distance = edges.nearest(other, position)
    normal = _unit(_between(edges.normal, edge, along))
    normal_other = _unit(_between(edges.normal, other, along_other))
    alike = dot(normal, normal_other) > _SAME_NORMAL
    texel = np.minimum(edges.texel[edge], edges.texel[other])
    k = np.flatnonzero(alike & (distance < _SAME_PLACE * texel))
    if tracer is not None:
        aside = _ASIDE * texel[k, None]
        above = position[k] + aside * _unit(normal[k] + normal_other[k])
        a, b = (above + aside * edges.inwards[of] for of in (edge[k], other[k]))
        k = k[~_parted(a, b, tracer)]
    here, there = edge[k], other[k]
    places = _between(edges.place, here, along[k]), _between(edges.place, there, along_other[k])
    images = np.stack([edges.image[here], edges.image[there]], axis=1)
    return Seams(images, np.stack(places, axis=1), edges.folds(here, there))


def _pairs(edges: _Edges, edge: np.ndarray, position: np.ndarray, progress: Progress) -> tuple[np.ndarray, np.ndarray]:
    """Every sample with every other edge that its edge may meet: samples and edges, (n,) each."""
    a, b = _edges_that_may_meet(edges, edge, position, progress)
    first = np.cumsum(edges.n_samples) - edges.n_samples
    pair, nth = unrolled(edges.n_samples[a])
    return first[a[pair]] + nth, b[pair]


def _edges_that_may_meet(
    edges: _Edges, edge: np.ndarray, position: np.ndarray, progress: Progress
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of edges that have samples close to each other, in both orders."""
    from scipy.spatial import cKDTree  # here, since Blender's start imports this room and should not wait for SciPy

    spacing = float((edges.texel / _A_TEXEL).max())
    tree, codes = cKDTree(position), []
    for chunk in slices(len(position), _CHUNK):
        progress.update(_STAGE, 0.5 * chunk.start / len(position))
        distance, neighbour = tree.query(position[chunk], _NEIGHBOURS, distance_upper_bound=spacing, workers=-1)
        k, column = np.nonzero(np.isfinite(distance))
        a, b = edge[chunk][k], edge[neighbour[k, column]]
        low, high = np.minimum(a, b)[a != b], np.maximum(a, b)[a != b]
        codes.append(np.unique(low * len(edges) + high))
    low, high = np.divmod(np.unique(np.concatenate(codes)), len(edges))
    met = np.concatenate([edges.meet(low[chunk], high[chunk]) for chunk in slices(max(len(low), 1), _CHUNK)])
    return np.concatenate([low[met], high[met]]), np.concatenate([high[met], low[met]])


def _parted(a: np.ndarray, b: np.ndarray, tracer: Tracer) -> np.ndarray:
    """Whether a surface stands between points (n, 3), (n,) bool."""
    a, way = a.astype(np.float32), (b - a).astype(np.float32)
    length = np.maximum(np.sqrt(dot(way, way)), np.float32(1e-30))
    return tracer.closest_hit(a, way / length[:, None], length).hit


def _between(ends: np.ndarray, edge: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Values along edges, of values (e, 2, d) at their ends, (n, d)."""
    start, end = np.moveaxis(rows(ends, edge), 1, 0)
    return start + along[:, None] * (end - start)


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors (n, d) of unit length."""
    return vectors / np.maximum(np.sqrt(dot(vectors, vectors)), 1e-30)[:, None]
