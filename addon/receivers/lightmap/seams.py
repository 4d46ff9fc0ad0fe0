"""Seams: where charts meet in space and lie apart on their images."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core.compiling import kernel, part
from ...core.parallel import slices
from ...core.progress import Progress
from ...core.ranges import repeat_ranges
from ...core.sampling.vectors import dot, rows
from ...core.vec3 import along as point_along
from ...core.vec3 import dot as scalar_product
from ...core.vec3 import length, minus, row
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


class _Edges(NamedTuple):
    """The border edges of charts, for kernels too.

    Attributes
    ----------
    image : (e,) int32
    position, normal, place : (e, 2, …) float64
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
        normal = charts.normals[triangle[:, None], ends].astype(np.float64)
        return _Edges(charts.image[triangle], position, normal, place, inwards, texel, n_samples)

    def samples(self) -> tuple[np.ndarray, np.ndarray]:
        """Edge of each sample, and how far along it lies, evenly spaced."""
        edge, nth = repeat_ranges(self.n_samples)
        return edge, (nth + 0.5) / self.n_samples[edge]


@part
def _end(ends, edge, k):
    """What an edge has at an end, of values (e, 2, 3)."""
    return row(ends[edge], k)


@part
def _at(ends, edge, along):
    """What an edge has at a place along it, of values (e, 2, 3) at the ends."""
    start = _end(ends, edge, 0)
    return point_along(start, along, minus(_end(ends, edge, 1), start))


@part
def _nearest(edges, edge, position):
    """How far along an edge the place next to a position lies, and their distance."""
    start = _end(edges.position, edge, 0)
    way = minus(_end(edges.position, edge, 1), start)
    along = scalar_product(minus(position, start), way) / max(scalar_product(way, way), 1e-30)
    along = min(max(along, 0.0), 1.0)
    return along, length(minus(point_along(start, along, way), position))


@part
def _fold(edges, a, b):
    """How far the surface turns from an edge to another, radians."""
    cosine = scalar_product(row(edges.inwards, a), row(edges.inwards, b))
    return np.pi - np.arccos(min(max(cosine, -1.0), 1.0))


@kernel
def _meet(edges, a, b, met):
    """Whether an end of one edge (n,) lies on the other (n,), as it does where edges run along each other."""
    for k in range(len(a)):
        distance = np.inf
        for end in range(2):
            distance = min(distance, _nearest(edges, b[k], _end(edges.position, a[k], end))[1])
            distance = min(distance, _nearest(edges, a[k], _end(edges.position, b[k], end))[1])
        near = distance < _SAME_PLACE * min(edges.texel[a[k]], edges.texel[b[k]])
        met[k] = near and _fold(edges, a[k], b[k]) < _FOLDED_BACK


@kernel
def _find_seams(edges, edge, along, other, along_other, fold, on_seam):
    """Whether samples of edges (n,) lie on other edges (n,) with a normal alike, where along these, and the fold."""
    for k in range(len(edge)):
        along_other[k], distance = _nearest(edges, other[k], _at(edges.position, edge[k], along[k]))
        a, b = _at(edges.normal, edge[k], along[k]), _at(edges.normal, other[k], along_other[k])
        sizes = max(length(a) * length(b), 1e-30)
        near = distance < _SAME_PLACE * min(edges.texel[edge[k]], edges.texel[other[k]])
        on_seam[k] = near and scalar_product(a, b) > _SAME_NORMAL * sizes
        fold[k] = _fold(edges, edge[k], other[k])


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
        found.append(_seams(edges, edge[some], along[some], other[chunk], tracer))
    return Seams(*(np.concatenate([getattr(part, name) for part in found]) for name in Seams.__dataclass_fields__))


def _seams(edges: _Edges, edge: np.ndarray, along: np.ndarray, other: np.ndarray, tracer: Tracer | None) -> Seams:
    """Seams among samples of edges (n,) and the edges that they may lie on, (n,)."""
    (along_other, fold), on_seam = np.empty((2, len(edge))), np.empty(len(edge), bool)
    _find_seams(edges, edge, along, other, along_other, fold, on_seam)
    here, there, along, along_other, fold = (of[on_seam] for of in (edge, other, along, along_other, fold))
    if tracer is not None:
        normal, normal_other = (_unit(_between(edges.normal, *of)) for of in ((here, along), (there, along_other)))
        aside = _ASIDE * np.minimum(edges.texel[here], edges.texel[there])[:, None]
        above = _between(edges.position, here, along) + aside * _unit(normal + normal_other)
        a, b = (above + aside * edges.inwards[of] for of in (here, there))
        joined = ~_parted(a, b, tracer)
        here, there, along, along_other, fold = (of[joined] for of in (here, there, along, along_other, fold))
    places = _between(edges.place, here, along), _between(edges.place, there, along_other)
    images = np.stack([edges.image[here], edges.image[there]], axis=1)
    return Seams(images, np.stack(places, axis=1), fold)


def _pairs(edges: _Edges, edge: np.ndarray, position: np.ndarray, progress: Progress) -> tuple[np.ndarray, np.ndarray]:
    """Every sample with every other edge that its edge may meet: samples and edges, (n,) each."""
    a, b = _edges_that_may_meet(edges, edge, position, progress)
    first = np.cumsum(edges.n_samples) - edges.n_samples
    pair, nth = repeat_ranges(edges.n_samples[a])
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
        codes.append(np.unique(low * len(edges.image) + high))
    low, high = np.divmod(np.unique(np.concatenate(codes)), len(edges.image))
    met = np.empty(len(low), bool)
    for chunk in slices(len(low), _CHUNK):
        _meet(edges, low[chunk], high[chunk], met[chunk])
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
