"""Photons go where they are worth something: each source's hypercube is sampled by what a first few photons were worth.

The hypercube is cut into cells along the dimensions that matter to the source. A photon of cell c is drawn with the
density q_c instead of 1 and carries 1/q_c of its power, so that its mean stays what it was. Least variance is had where
q_c follows the root mean square of what photons of the cell are worth. That is known from few photons: so neighbouring
cells are merged for a part of the density, and a part of it is even, whereby no photon carries more than 1/`EVEN` times
its power.
"""

from collections.abc import Callable

import numpy as np

from ..parallel import Workers
from ..scene import Scene
from ..tracers import LightTracer
from .photons import Photons
from .source import Rays, Source, Sphere
from .tracing import emitted_points, shares, trace_photons

EVEN = 0.25
"""Share of the photons that is spread evenly."""

_MOST_PILOTS = 1 << 17
_PILOT_SHARE = 4  # of the photons, that are traced first
_MERGED = 2  # cells along each dimension that are one for half of what is not even

Worth = Callable[[Photons], np.ndarray]
"""What stored photons are worth, (n,): their power where those who gather look much, less where they look little."""


class GuidedSource(Source):
    """A source whose photons go where photons were worth most.

    Parameters
    ----------
    source : Source
    u : (n, 5) float32
        Points of the hypercube.
    worth : (n,)
        What the photons of these points were worth.
    """

    def __init__(self, source: Source, u: np.ndarray, worth: np.ndarray) -> None:
        self._source = source
        self._be_like(source)
        self._shape = np.array(source.n_cells)
        fine = _root_mean_square(self._cell(u, 1), worth, self._shape)
        coarse = _root_mean_square(self._cell(u, _MERGED), worth, -(-self._shape // _MERGED))
        for axis, n in enumerate(self._shape):
            coarse = np.repeat(coarse, _MERGED, axis)[(slice(None),) * axis + (slice(n),)]
        guided = [part / part.mean() for part in (fine, coarse) if part.any()]
        density = EVEN + (1 - EVEN) * np.mean(guided, axis=0) if guided else np.ones(self._shape)
        self._density = density.ravel() / density.mean()
        self._cumulative = np.cumsum(self._density) / density.size
        self.worth = float(fine.mean())

    def emit(self, u: np.ndarray) -> Rays:
        """As the source does, with the last dimension choosing the cell."""
        place = u[:, -1].astype(np.float64) * self._cumulative[-1]
        cell = np.minimum(np.searchsorted(self._cumulative, place, side="right"), self._density.size - 1)
        density = self._density[cell]
        within = u.copy()
        within[:, -1] = (1 - (self._cumulative[cell] - place) * self._density.size / density).clip(0, 1)
        corner = np.stack(np.unravel_index(cell, self._shape), axis=1)
        moved = ((corner + within) / self._shape).astype(np.float32)
        rays = self._source.emit(np.minimum(moved, np.float32(1 - 2**-24)))
        return Rays(rays.origins, rays.directions, (rays.flux / density[:, None]).astype(np.float32), rays.objects)

    def _cell(self, u: np.ndarray, merged: int) -> np.ndarray:
        """The cell of each point, `merged` along each dimension being one, (n,) int."""
        shape = -(-self._shape // merged)
        steps = np.minimum((u * self._shape).astype(np.int64) // merged, shape - 1)
        return np.ravel_multi_index(tuple(steps.T), tuple(int(n) for n in shape))


def _root_mean_square(cell: np.ndarray, worth: np.ndarray, shape: np.ndarray) -> np.ndarray:
    """Of what the photons of each cell are worth, an array of `shape`; cells without photons are worth nothing."""
    n = int(np.prod(shape))
    squares, counts = np.bincount(cell, worth.astype(np.float64) ** 2, n), np.bincount(cell, minlength=n)
    return np.sqrt(squares / np.maximum(counts, 1)).reshape(shape)


def pilots_for(n_photons: int) -> int:
    """How many photons go ahead to guide so many."""
    return max(1, min(n_photons // _PILOT_SHARE, _MOST_PILOTS))


def guide_sources(
    scene: Scene,
    tracer: LightTracer,
    sources: list[Source],
    n_pilots: int,
    max_bounces: int,
    worth: Worth,
    workers: Workers,
    region: Sphere | None = None,
) -> list[Source]:
    """The sources, each guided by what its share of `n_pilots` photons is worth; the rest is as for `trace_photons`."""
    photons = trace_photons(scene, tracer, sources, n_pilots, max_bounces, workers, region=region)
    counts = shares(sources, n_pilots)
    of_path = np.bincount(photons.path, worth(photons), minlength=sum(counts))
    ends = np.cumsum(counts)
    points = emitted_points(sources, n_pilots, workers.seed)
    return [
        GuidedSource(source, u, of_path[end - count : end])
        for source, u, count, end in zip(sources, points, counts, ends, strict=True)
    ]
