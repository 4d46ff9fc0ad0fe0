"""Receivers at the texels of lightmaps."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...core.parallel import Workers
from ...tracing import Tracer
from ..receivers import Receivers
from .charts import Charts, LightmapMesh
from .coverage import Fragments, cells_of, texels_of
from .seams import Seams, seams_of
from .surroundings import STAGE, look_around, ways_out
from .texel_points import TexelPoints, points_of

LEAST_SHARE = 1e-3
"""A chart that covers less of a texel gives it no receiver, unless it covers no texel better."""

CELLS = 3
"""A texel close to other surfaces is cut into so many cells along each side, each with its receiver."""

_ALL = 0.95  # of a mesh's receivers inside of something: it is the surfaces that face the wrong way


@dataclass(frozen=True)
class Texels:
    """Where the values of n receivers go: row `i` of everything belongs to receiver `i`.

    Rows count from v = 0, columns from u = 0, as Blender's pixels and OpenGL's textures do: texel (row, column) of an
    image of height h and width w covers u from column/w to (column + 1)/w and v from row/h to (row + 1)/h.

    Attributes
    ----------
    sizes : tuple of (height, width)
        Of the images.
    image, row, column : (n,) int32
    weight : (n,) float32
        Share of the texel's area that the receiver stands for; a texel that is covered whole by one chart has 1.
    chart : (n,) int32
        Chart of the receiver. What of a chart is hidden inside other geometry counts as a chart of its own, numbered
        `Charts.n_charts` on.
    uv : (n, 2) float32
        Where on the image the receiver lies, in [0, 1].
    charts : Charts
        The triangles that the receivers lie on.
    seams : Seams
        Where the charts meet.
    """

    sizes: tuple[tuple[int, int], ...]
    image: np.ndarray
    row: np.ndarray
    column: np.ndarray
    weight: np.ndarray
    chart: np.ndarray
    uv: np.ndarray
    charts: Charts
    seams: Seams

    def __len__(self) -> int:
        return len(self.image)

    @property
    def n_covered(self) -> int:
        """How many texels have receivers."""
        heights, widths = np.array(self.sizes, np.int64).reshape(-1, 2).T
        first = np.cumsum(heights * widths) - heights * widths
        covered = np.zeros(int((heights * widths).sum()), bool)
        covered[first[self.image] + self.row * widths[self.image] + self.column] = True
        return int(np.count_nonzero(covered))


def texel_receivers(
    meshes: Sequence[LightmapMesh],
    sizes: Sequence[tuple[int, int]],
    tracer: Tracer | None = None,
    workers: Workers | None = None,
) -> tuple[Receivers, Texels]:
    """Receivers for every texel that a chart touches, and where their values go.

    Each patch of a chart (a part without sharp edges) has a receiver in each texel that it touches, at the mean place
    of what it covers there.

    Parameters
    ----------
    sizes : sequence of (height, width)
        Of each image that the meshes name.
    tracer : Tracer, optional
        With it, texels close to other surfaces get a receiver for each of `CELLS`² cells, and receivers that would
        start inside other geometry are left out or moved out of it, as far as look-ups outside reach for them.
    """
    workers = workers or Workers()
    workers.progress.update(STAGE, 0)
    charts = Charts.of(meshes, workers.progress)
    grid = _Grid.of(sizes)
    corners = charts.uv.astype(np.float64) * grid.sizes[charts.image, None]
    fragments = texels_of(corners, grid.sizes[charts.image], workers)
    points, point_of_fragment = points_of(charts, corners, fragments, grid.texels(charts, fragments), workers)
    kept = _worthwhile(charts, points)
    if tracer is None:
        points, hidden = points.where(kept), np.zeros(int(kept.sum()), bool)
    else:
        around = look_around(points, tracer, workers.part(0, 0.4))
        close = fragments.where((around.near & kept)[point_of_fragment])
        cells = cells_of(corners, close, CELLS, workers)
        fine, _ = points_of(charts, corners, cells, grid.texels(charts, cells), workers, CELLS)
        far = kept & ~around.near
        points = TexelPoints.join([points.where(far), fine])
        inside = np.concatenate([around.inside[far], look_around(fine, tracer, workers.part(0.4, 0.8)).inside])
        points, hidden = _pushed_out(charts, points, inside, tracer, workers.part(0.8, 1))
    workers.progress.update(STAGE, 1)
    seams = seams_of(charts, _sizes(grid), tracer, workers.progress)
    return Receivers(points.position, points.normal, points.footprint), _texels(points, hidden, charts, grid, seams)


@dataclass(frozen=True)
class _Grid:
    """The texels of all images: width and height of each image (i, 2) int64, and number of its first texel (i,)."""

    sizes: np.ndarray
    first: np.ndarray

    @staticmethod
    def of(sizes: Sequence[tuple[int, int]]) -> "_Grid":
        widths_heights = np.array(sizes, np.int64).reshape(-1, 2)[:, ::-1]
        return _Grid(widths_heights, np.cumsum([0, *widths_heights.prod(axis=1)])[:-1])

    def texels(self, charts: Charts, fragments: Fragments) -> np.ndarray:
        """Number of the texel of each fragment, counted over all images."""
        image = charts.image[fragments.triangle]
        return self.first[image] + fragments.texel[:, 1].astype(np.int64) * self.sizes[image, 0] + fragments.texel[:, 0]


def _worthwhile(charts: Charts, points: TexelPoints) -> np.ndarray:
    """Which points stand for enough of their texel, or belong to a chart that has none better, (n,) bool."""
    chart = charts.chart[points.triangle]
    best = np.zeros(charts.n_charts)
    np.maximum.at(best, chart, points.share)
    return (points.share >= LEAST_SHARE) | (best[chart] < LEAST_SHARE)


def _pushed_out(
    charts: Charts, points: TexelPoints, inside: np.ndarray, tracer: Tracer, workers: Workers
) -> tuple[TexelPoints, np.ndarray]:
    """The points that are worth a receiver, and which of them are hidden in solids, (n,) bool.

    Of those inside solids, the ones whose texel has points outside as well are left out, and those next to such texels
    are moved out: look-ups outside reach for them. The rest stay, and are dark. A mesh whose points all are inside
    stays as it is: it is hidden, or in a room whose surfaces face outwards.
    """
    mesh = charts.mesh[points.triangle]
    n_meshes = int(charts.mesh.max(initial=-1)) + 1
    share_inside = np.bincount(mesh, inside, n_meshes) / np.maximum(np.bincount(mesh, minlength=n_meshes), 1)
    inside = inside & (share_inside < _ALL)[mesh]
    kept = ~inside | ~np.isin(points.texel, points.texel[~inside])
    points, inside = points.where(kept), inside[kept]
    k = np.flatnonzero(inside)
    way = ways_out(points.where(k), tracer, workers)
    position, place, hidden = points.position.copy(), points.place.copy(), inside.copy()
    position[k] += np.einsum("ns,nsi->ni", way, points.across[k])
    place[k] += way
    hidden[k] = ~way.any(axis=1)
    return replace(points, position=position, place=place), hidden


def _sizes(grid: _Grid) -> tuple[tuple[int, int], ...]:
    return tuple((int(height), int(width)) for width, height in grid.sizes)


def _texels(points: TexelPoints, hidden: np.ndarray, charts: Charts, grid: _Grid, seams: Seams) -> Texels:
    image, chart = charts.image[points.triangle], charts.chart[points.triangle]
    row, column = np.divmod(points.texel - grid.first[image], grid.sizes[image, 0])
    return Texels(
        sizes=_sizes(grid),
        image=image,
        row=row.astype(np.int32),
        column=column.astype(np.int32),
        weight=points.share.astype(np.float32),
        chart=np.where(hidden, chart + charts.n_charts, chart),
        uv=(points.place / grid.sizes[image]).astype(np.float32),
        charts=charts,
        seams=seams,
    )
