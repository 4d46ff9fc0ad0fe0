"""Direct light at all vertices and sides, estimate by estimate."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ....core.sampling.path_numbers import path_key
from ....gather import DirectLight
from ....gather.direct.ray_directions import stratified_set
from ....receivers import Receivers
from ....settings.live import LiveSettings
from ....tracing import TransparencyTracer
from ....tracing.embree import new_ray
from ..jobs import Job
from .direct import Estimates, light_sides, light_vertices
from .linking import Linking

_OF_VERTICES, _OF_SIDES = 63, 64  # streams of random numbers


@dataclass
class Lighting:
    """What is known of direct light.

    Attributes
    ----------
    vertices, sides : Estimates
        Rows as those of `Linking`.
    """

    direct: DirectLight
    tracer: TransparencyTracer
    receivers: Receivers
    objects: np.ndarray
    linking: Linking
    settings: LiveSettings
    vertices: Estimates
    sides: Estimates

    def again(self) -> None:
        """After an edit: all is to be found again."""
        self.vertices.again()
        self.sides.again()

    def light_vertices(self, n: int) -> Job:
        """N more estimates of all vertices."""
        estimates, at, key = self.vertices, self.receivers, path_key(self.settings.seed, _OF_VERTICES)
        first, last = estimates.n_fresh, min(estimates.n_fresh + n, estimates.n_most)
        arrays, objects = (self.direct.arrays, self.tracer.arrays), self.objects

        def light(chunk: slice) -> None:
            place = at.position, at.normal, objects, key, chunk.start, chunk.stop
            light_vertices(*arrays, new_ray(), *place, first, last, estimates.arrays)

        def done() -> None:
            estimates.n_fresh = last

        return Job(len(at), n, light, done)

    def light_sides(self, n: int) -> Job:
        """N more estimates of all sides that are reached, as far as they have links."""
        estimates, sides = self.sides, self.linking.reached
        first = estimates.n_fresh
        last = min(first + n, max(self.linking.sides.n_traced, first))

        def done() -> None:
            estimates.n_fresh = last

        return Job(len(sides), n, self._side_lighter(sides, first, last), done)

    def light_new(self, sides: np.ndarray) -> Job:
        """Of sides that are reached for the first time, as many estimates as others have."""
        last = self.sides.n_fresh
        return Job(len(sides), last, self._side_lighter(sides, 0, last))

    def _side_lighter(self, sides: np.ndarray, first: int, last: int) -> Callable[[slice], None]:
        links, of = self.linking.sides, self.sides.arrays
        arrays = self.direct.arrays, self.tracer.arrays
        keys = path_key(self.settings.seed, _OF_SIDES), self.linking.key_of_sides
        how = stratified_set(links.n_most), *keys, sides, links.end
        elements = self.linking.pilot.elements.arrays

        def light(chunk: slice) -> None:
            light_sides(*arrays, new_ray(), elements, *how, chunk.start, chunk.stop, first, last, of)

        return light
