"""Photons go where they are important: each source's hypercube is sampled by the importance of a first few photons.

The hypercube is cut into cells along the dimensions that matter to the source. A photon of cell c is drawn with the
density q_c instead of 1 and carries 1/q_c of its power, so that its mean stays what it was. Variance is least where q_c
follows the root mean square of the importance of the cell's photons. That is known from few photons, the pilots: so
cells start from what the larger cells around them say, as if `_PRIOR` photons had said it, and a part of the density is
even, whereby no photon carries more than 1/`EVEN` times its power.

The same pilots say how many photons each source gets: the variance of all together is least where the numbers follow
the root mean square of the importance of each source's photons (Neyman). Of a source that is seen through a keyhole
pilots may say nothing. So its noise is estimated as if one photon more, of those that fly towards where light is
wanted, had arrived there (Laplace's rule of succession).
"""

from collections.abc import Callable

import numpy as np

from ..core.parallel import Workers
from ..core.sampling.vectors import dot
from ..emitters import Rays, Source, Sphere
from ..emitters.aiming.guided import Guide
from ..scene import Scene
from ..tracing import TransparencyTracer
from .emission import Pass, emitted_points, shares
from .photons import Photons
from .tracing import trace_photons

EVEN = 0.25
"""Share of the photons that is spread evenly."""

_MOST_PILOTS = 1 << 17
_PILOT_SHARE = 4  # of the photons, that are traced first
_MERGED = (8, 4, 2, 1)  # cells along each dimension that are one
_PRIOR = 8.0  # photons, for which what is known of the larger cell around it counts in a cell

Importance = Callable[[Photons], np.ndarray]
"""The importance of stored photons, (n,): power, by how much those who gather look there."""


class GuidedSource(Source):
    """A source whose photons go where photons were most important.

    Parameters
    ----------
    source : Source
    u : (n, 5) float32
        Points of the hypercube.
    importance : (n,)
        Of the photons of these points, if each carries the flux of its ray.
    one_more : float
        The importance of one more that arrives.

    Attributes
    ----------
    deviation : float
        Root mean square of a photon's importance, the one more among them.
    """

    def __init__(self, source: Source, u: np.ndarray, importance: np.ndarray, one_more: float = 0.0) -> None:
        self._be_like(source)
        squares = float(np.sum(importance.astype(np.float64) ** 2))
        self.importance = np.sqrt(squares / max(len(u), 1))
        self.deviation = np.sqrt((squares + one_more**2) / (len(u) + 1))
        self._shape = np.array(source.n_cells)
        guided = np.sqrt(self._mean_square(u, importance))
        density = EVEN + (1 - EVEN) * guided / max(guided.mean(), 1e-300)
        self.guide = Guide(density / density.mean())

    def _mean_square(self, u: np.ndarray, importance: np.ndarray) -> np.ndarray:
        """Of the importance of each cell's photons, an array of `n_cells`: from coarse cells to ever finer ones."""
        squares = importance.astype(np.float64) ** 2
        mean = np.full(tuple(self._shape), squares.mean() if len(squares) else 0.0)
        for merged in _MERGED:
            cell, shape = self._cell(u, merged), -(-self._shape // merged)
            columns = (np.bincount(cell, weights, shape.prod()).reshape(shape) for weights in (squares, None))
            sums, counts = (self._spread(column, merged) for column in columns)
            mean = (sums + _PRIOR * mean) / (counts + _PRIOR)
        return mean

    def _spread(self, values: np.ndarray, merged: int) -> np.ndarray:
        """Values of merged cells, for each cell."""
        for axis, n in enumerate(self._shape):
            values = np.repeat(values, merged, axis)[(slice(None),) * axis + (slice(n),)]
        return values

    def _cell(self, u: np.ndarray, merged: int) -> np.ndarray:
        """The cell of each point, `merged` along each dimension being one, (n,) int."""
        shape = -(-self._shape // merged)
        steps = np.minimum((u * self._shape).astype(np.int64) // merged, shape - 1)
        return np.ravel_multi_index(tuple(steps.T), tuple(int(n) for n in shape))


def pilots_for(n_photons: int) -> int:
    """How many photons go ahead to guide so many."""
    return max(1, min(n_photons // _PILOT_SHARE, _MOST_PILOTS))


def guide_sources(
    scene: Scene,
    tracer: TransparencyTracer,
    sources: list[Source],
    n_pilots: int,
    max_bounces: int,
    importance: Importance,
    workers: Workers,
    region: Sphere | None = None,
    importance_of_watt: float = 0.0,
) -> list[GuidedSource]:
    """The sources, each guided by the importance of its share of `n_pilots` photons; the rest as for `trace_photons`.

    Parameters
    ----------
    importance_of_watt : float
        Of a photon of a watt that arrives where light is wanted.
    """
    photons = trace_photons(scene, tracer, sources, n_pilots, max_bounces, workers, region=region, of=Pass.PILOTS)
    counts = shares(sources, n_pilots)
    of_path = np.bincount(photons.path, importance(photons), minlength=sum(counts))
    points, guided, end = emitted_points(sources, n_pilots, workers.seed, Pass.PILOTS), [], 0
    for source, u in zip(sources, points, strict=True):
        start, end = end, end + len(u)
        one_more = importance_of_watt * _flux_towards(region, source.emit(u))
        guided.append(GuidedSource(source, u, len(u) * of_path[start:end], one_more))
    return guided


def noise_of_photons(sources: list[GuidedSource], n_photons: int) -> float:
    """Standard deviation of the importance of so many photons of all sources together, from what the pilots showed."""
    counts = shares(list[Source](sources), n_photons)
    return float(np.sqrt(sum(source.deviation**2 / n for source, n in zip(sources, counts, strict=True))))


def _flux_towards(region: Sphere | None, rays: Rays) -> float:
    """Mean flux of the rays that would meet a region if nothing were on their way, or of all if none would, W."""
    flux = np.abs(rays.flux).mean(axis=1, dtype=np.float64)
    if region is not None:
        way = region.centre - rays.origins
        along = dot(way, rays.directions)
        aside = way - along[:, None] * rays.directions
        inside = dot(way, way) < region.radius**2
        meets = inside | ((along > 0) & (dot(aside, aside) < region.radius**2))
        flux = flux[meets] if meets.any() else flux
    return float(flux.mean())
