"""How photons' paths come about: numbered for good, in rounds, of all sources together."""

from collections.abc import Sequence

import numpy as np

from ....emitters import Source
from ....gather.radiance_cache.elements import SurfaceElements
from ....photons.emission import Emission, Pass, shares
from ....photons.front import Front, new_front
from ....photons.tracing import HitArrays, specular_flight
from ....scene import Scene
from ....tracing import Hits, TransparencyTracer
from .paths import N_SURFACES, PathArrays, record, start_paths
from .photon_map import level_of_round

N_IN_ROUND = 4096
"""Photons that are traced together, of all sources, about."""

_FAR = 4  # diagonals of the scene, where photons end that leave it


class PathTracing:
    """Photons of a scene's sources, whose numbers say all about them: the same number takes the same random numbers.

    Those of a source are numbered one after the other, as many for each round.

    Parameters
    ----------
    sources : sequence of Source
    n_rounds : int

    Attributes
    ----------
    n : int
        Photons of all rounds.
    n_of_source : (s,) int64
        In a round.
    """

    def __init__(self, sources: Sequence[Source], n_rounds: int, elements: SurfaceElements, seed: int) -> None:
        self.n_rounds, self._seed, self._elements = n_rounds, seed, elements
        self.n_of_source = np.array(shares(sources, N_IN_ROUND), np.int64)
        self.n = int(self.n_of_source.sum()) * n_rounds
        self._first = np.cumsum([0, *(self.n_of_source * n_rounds)])
        within = np.arange(self.n) - np.repeat(self._first[:-1], self.n_of_source * n_rounds)
        self.round_of = (within // np.repeat(self.n_of_source, self.n_of_source * n_rounds)).astype(np.int32)
        self.level = level_of_round(self.round_of)
        self._kinds = _kinds(sources)

    def is_of(self, sources: Sequence[Source]) -> bool:
        """Whether other sources are as many and of the same kinds, so that photons keep their numbers."""
        return _kinds(sources) == self._kinds

    def aim(self, scene: Scene, tracer: TransparencyTracer, sources: Sequence[Source]) -> None:
        """Take the scene and its sources as they are now."""
        counts = [int(n) * self.n_rounds for n in self.n_of_source]
        self.emission = Emission(sources, counts, self._seed, Pass.LIVE)
        self._flight = specular_flight(scene, tracer, sources, N_SURFACES, self._seed, Pass.LIVE)
        self._far = np.float32(_FAR * scene.diagonal)
        self._arrays = tracer.arrays.scene

    def of_round(self, i: int) -> np.ndarray:
        """Numbers of the photons of a round, which rise, (m,) int64."""
        starts = self._first[:-1] + i * self.n_of_source
        return np.concatenate([np.arange(a, a + n) for a, n in zip(starts, self.n_of_source, strict=True)])

    def trace(self, numbers: np.ndarray, rows: np.ndarray, out: PathArrays) -> None:
        """Trace photons of numbers that rise, (m,) int64, each into its row."""
        front, elements = new_front(len(numbers)), self._elements.arrays
        front.path[:] = numbers
        self.emission.start_paths(front)
        start_paths(front, rows, out)
        viewers = self._flight.rules.viewers

        def watch(bounce: int, of: Front, n: int, hits: Hits) -> None:
            at = HitArrays(hits.triangle, hits.distance, hits.u, hits.v)
            record(self._arrays, elements, viewers, bounce, of, n, at, self._far, numbers, rows, out)

        self._flight.fly(front, watch=watch)


def _kinds(sources: Sequence[Source]) -> list[tuple[int, int, int]]:
    return [(source.kind, source.lamp, source.max_bounces) for source in sources]


def watts_of(sources: Sequence[Source]) -> float:
    """Power of all sources together, the mean over colours."""
    return float(sum(np.abs(source.power).mean() for source in sources))
