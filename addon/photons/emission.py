"""How photons start: those of all sources are numbered one source after the other, and any of them starts alone.

The i-th photon of a source starts from the i-th point of a Sobol sequence of the source's own. So lamps share batches,
and no photon depends on how they are cut.
"""

from collections.abc import Sequence
from enum import Enum

import numpy as np

from ..core.compiling import kernel, part
from ..core.sampling.sobol import sobol_point, sobol_points, sobol_seeds
from ..core.vec3 import put, times
from ..emitters import Rays, Source
from ..emitters.emission import Emitters, emit
from ..emitters.source import emitters_of
from .front import Front

_EVEN = 0.25  # of the photons is shared evenly: no source is left out, however little of it is found at first
_ONE = np.float32(1)


class Pass(Enum):
    """What photons are traced for: the streams of random numbers of their emission and of their scattering.

    The pilots' photons are others than those that they guide, lest what is chosen depend on what it is chosen by.
    """

    PHOTONS = (1, 2)
    PILOTS = (4, 5)
    LIVE = (116, 117)


def shares(sources: Sequence[Source], n_photons: int) -> list[int]:
    """How many photons each source emits: a quarter of them evenly, the rest by importance, and at least one."""
    importance = np.array([source.importance for source in sources])
    even = np.full(len(sources), 1 / max(len(sources), 1))
    by_importance = importance / importance.sum() if importance.any() else even
    return [max(1, round(n_photons * share)) for share in _EVEN * even + (1 - _EVEN) * by_importance]


@part
def emitted_photon(emitters, seeds, first, source, path):
    """The photon of a path of a source: origin, direction, power, and the object it leaves (−1: none)."""
    u = sobol_point(seeds, source, path - first[source])
    origin, direction, flux, object_ = emit(emitters, source, u[0], u[1], u[2], u[3], u[4])
    return origin, direction, times(flux, _ONE / np.float32(first[source + 1] - first[source])), object_


@kernel
def emit_photons(emitters, seeds, first, front):
    """Fill a front with the photons of its paths, whose numbers rise; of source s first[s] to first[s + 1]."""
    source = np.int64(0)
    for k in range(len(front.path)):
        path = np.int64(front.path[k])
        while path >= first[source + 1]:
            source += 1
        origin, direction, power, object_ = emitted_photon(emitters, seeds, first, source, path)
        put(front.origin, k, origin)
        put(front.direction, k, direction)
        put(front.power, k, power)
        front.came_from[k], front.source[k] = object_, source


class Emission:
    """The photons that sources emit.

    Parameters
    ----------
    counts : list of int
        How many each source emits.

    Attributes
    ----------
    n : int
        All of them.
    """

    def __init__(self, sources: Sequence[Source], counts: list[int], seed: int, of: Pass) -> None:
        self._first = np.cumsum([0, *counts])
        self.n = int(self._first[-1])
        self._seeds = sobol_seeds(len(sources), seed, of.value[0])
        self._emitters = emitters_of(sources) if sources else None

    def start(self, front: Front, paths: slice) -> None:
        """Fill a front with the photons of as many paths."""
        front.path[:] = np.arange(paths.start, paths.stop)
        self.start_paths(front)

    def start_paths(self, front: Front) -> None:
        """Fill a front with the photons of the paths that it has, whose numbers rise."""
        emit_photons(*self.arrays, front)

    @property
    def arrays(self) -> tuple[Emitters | None, np.ndarray, np.ndarray]:
        """What kernels take: emitters, seeds, and the first path of each source."""
        return self._emitters, self._seeds, self._first

    def points(self, source: int) -> np.ndarray:
        """The points of a source's hypercube from which its photons start, (n, 5) float32."""
        return sobol_points(self._seeds, source, 0, int(self._first[source + 1] - self._first[source]))


class PictureEmission(Emission):
    """Photons on the rays of each source's bounce map."""

    def __init__(self, rays: list[Rays]) -> None:
        counts = [len(of.flux) for of in rays]
        self._first = np.cumsum([0, *counts])
        self.n = int(self._first[-1])
        self._rays = rays

    def start(self, front: Front, paths: slice) -> None:
        """Fill a front with the photons of as many paths."""
        for source, rays in enumerate(self._rays):
            first, last = self._first[source], self._first[source + 1]
            a, b = max(paths.start, first), min(paths.stop, last)
            if a < b:
                at, of = slice(a - paths.start, b - paths.start), slice(a - first, b - first)
                front.origin[at], front.direction[at] = rays.origins[of], rays.directions[of]
                front.power[at] = rays.flux[of] / np.float32(last - first)
                front.came_from[at], front.source[at] = rays.objects[of], source
        front.path[:] = np.arange(paths.start, paths.stop)


def emitted_rays(sources: Sequence[Source], n_photons: int, seed: int) -> list[Rays]:
    """The rays on which `trace_photons` would start so many photons."""
    points = emitted_points(sources, n_photons, seed, Pass.PHOTONS)
    return [source.emit(u) for source, u in zip(sources, points, strict=True)]


def emitted_points(sources: Sequence[Source], n_photons: int, seed: int, of: Pass) -> list[np.ndarray]:
    """The points of the hypercubes from which `trace_photons` would start, an array (n, 5) for each source."""
    emission = Emission(sources, shares(sources, n_photons), seed, of)
    return [emission.points(k) for k in range(len(sources))]
