"""Direct light at all vertices and sides, estimate by estimate."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from ....core.sampling.path_numbers import path_key
from ....gather.direct.ray_directions import stratified_set
from ....receivers import Receivers
from ....settings.live import LiveSettings
from ....tracing import TransparencyTracer
from ....tracing.embree import new_ray
from ..jobs import Job
from .direct import light_sides, light_vertices
from .estimates import Estimates
from .linking import Linking
from .links import light_near_sides, light_near_vertices

_OF_VERTICES, _OF_SIDES = 113, 114  # streams of random numbers
_MOST_NEAR, _LEAST_NEAR, _MOST_NEAR_SIDES = 128, 16, 32  # estimates of what is near; of more vertices each has fewer


@dataclass
class Lighting:
    """What is known of direct light.

    Attributes
    ----------
    vertices, sides : Estimates
        Of light straight from lamps; rows as those of `Linking`.
    near_vertices, near_sides : Estimates
        Of what points that are near make of light straight from lamps.
    """

    tracer: TransparencyTracer
    receivers: Receivers
    objects: np.ndarray
    linking: Linking
    settings: LiveSettings
    vertices: Estimates
    sides: Estimates
    near_vertices: Estimates
    near_sides: Estimates

    @staticmethod
    def of(
        tracer: TransparencyTracer,
        receivers: Receivers,
        objects: np.ndarray,
        linking: Linking,
        settings: LiveSettings,
    ) -> "Lighting":
        """Nothing is known."""
        n, (n_sides, n_links) = len(receivers), linking.sides.end.shape
        vertices, sides = Estimates.none(n, settings.n_direct, False), Estimates.none(n_sides, n_links, True)
        most_near = max(settings.of_each(_MOST_NEAR, n), _LEAST_NEAR)
        n_near = min(linking.vertices.n_most, most_near), min(n_links, _MOST_NEAR_SIDES)
        near = Estimates.none(n, n_near[0], False), Estimates.none(n_sides, n_near[1], True)
        return Lighting(tracer, receivers, objects, linking, settings, vertices, sides, *near)

    @property
    def finished(self) -> bool:
        """Whether all is known that will be."""
        return all(one.finished for one in (self.vertices, self.sides, self.near_vertices, self.near_sides))

    def again(self, near: bool) -> None:
        """After an edit: all is to be found again, or what near points make of light alone."""
        for one in (self.near_vertices, self.near_sides) if near else (self.vertices, self.sides):
            one.again()

    def light_vertices(self, n: int) -> Job:
        """N more estimates of all vertices."""
        estimates, at, key = self.vertices, self.receivers, path_key(self.settings.seed, _OF_VERTICES)
        first, last = estimates.n_fresh, min(estimates.n_fresh + n, estimates.n_most)
        arrays, objects = (self.linking.direct.arrays, self.tracer.arrays), self.objects

        def light(chunk: slice) -> None:
            place = at.position, at.normal, objects, key, chunk.start, chunk.stop
            light_vertices(*arrays, new_ray(), *place, first, last, estimates.arrays)

        return Job(len(at), n, light, partial(estimates.made_to, last))

    def light_sides(self, n: int) -> Job:
        """N more estimates of all sides that are reached, as far as they have links."""
        estimates, sides = self.sides, self.linking.reached
        first = estimates.n_fresh
        last = min(first + n, max(self.linking.sides.n_traced, first))

        return Job(len(sides), n, self._side_lighter(sides, first, last), partial(estimates.made_to, last))

    def light_new(self) -> Job:
        """Of sides that are reached for the first time, as many estimates as others have."""
        sides, last, near = self.linking.unlit, self.sides.n_fresh, self.near_sides.n_fresh
        direct, reflected = self._side_lighter(sides, 0, last), self._near_side_lighter(sides, 0, near)

        def light(chunk: slice) -> None:
            direct(chunk)
            reflected(chunk)

        def done() -> None:
            self.linking.unlit = sides[:0]

        return Job(len(sides), last + near, light, done)

    def light_near_vertices(self, n: int) -> Job:
        """N more estimates of what is near vertices, as far as these have links."""
        estimates, at, linking = self.near_vertices, self.receivers, self.linking
        links, points = linking.vertices, stratified_set(linking.vertices.n_most)
        first = estimates.n_fresh
        last = max(min(first + n, estimates.n_most, links.n_traced), first)

        def light(chunk: slice) -> None:
            place = at.position, at.normal, points, linking.key_of_vertices
            rows = chunk.start, chunk.stop, first, last, links.arrays, estimates.arrays
            light_near_vertices(linking.met(), *place, *rows)

        return Job(len(at), n, light, partial(estimates.made_to, last))

    def light_near_sides(self, n: int) -> Job:
        """The same for the sides that are reached."""
        estimates, sides = self.near_sides, self.linking.reached
        first = estimates.n_fresh
        last = max(min(first + n, estimates.n_most, self.linking.sides.n_traced), first)

        return Job(len(sides), n, self._near_side_lighter(sides, first, last), partial(estimates.made_to, last))

    def _near_side_lighter(self, sides: np.ndarray, first: int, last: int) -> Callable[[slice], None]:
        linking, links, of = self.linking, self.linking.sides, self.near_sides.arrays
        how = sides, stratified_set(links.n_most), linking.key_of_sides

        def light(chunk: slice) -> None:
            light_near_sides(linking.met(), *how, chunk.start, chunk.stop, first, last, links.arrays, of)

        return light

    def _side_lighter(self, sides: np.ndarray, first: int, last: int) -> Callable[[slice], None]:
        links, of = self.linking.sides, self.sides.arrays
        arrays = self.linking.direct.arrays, self.tracer.arrays
        keys = path_key(self.settings.seed, _OF_SIDES), self.linking.key_of_sides
        how = stratified_set(links.n_most), *keys, sides, links.end
        elements = self.linking.pilot.elements.arrays

        def light(chunk: slice) -> None:
            light_sides(*arrays, new_ray(), elements, *how, chunk.start, chunk.stop, first, last, of)

        return light
