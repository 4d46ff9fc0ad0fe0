"""The links of all vertices, and of those sides of elements that light may come from: traced, and renewed."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ....core.errors import BakeError
from ....core.sampling.path_numbers import path_key
from ....gather import DirectLight, ImportancePilot
from ....gather.direct.ray_directions import stratified_set
from ....gather.radiance_cache.radiance_cache import NEAR
from ....receivers import Receivers
from ....scene import Lobe, Scene
from ....settings.live import LiveSettings
from ....tracing import TransparencyTracer
from ....tracing.embree import new_ray
from ..jobs import Job, Plan
from .crossings import mark_followed, mark_side_links, mark_vertex_links
from .links import BYTES, LinkLight, Links, trace_side_links, trace_vertex_links

_OF_VERTICES, _OF_SIDES = 111, 112  # streams of random numbers
_BLOCK, _SIDE_BLOCK = 16, 16  # links of a row that a step adds at least
_GROWTH = 4  # a step adds to a row this part of the links that are there
_CHECKS = 16  # links are looked at as fast as one is traced


@dataclass
class Linking:
    """Links, and how more of them come about.

    Attributes
    ----------
    vertices, sides : Links
        Rows are vertices, and all sides of elements.
    reached : (k,) int64
        The sides that links end on, in the order in which they were found; others have no links.
    found : (f,) int64
        Sides that links end on as well, and that have none of their own yet.
    unlit : (u,) int64
        Of those that are reached, those of which no direct light is known yet.
    caustics : (s, 3) or (0, 3) float32, W/(m² sr)
        See `LinkLight`.
    """

    scene: Scene
    tracer: TransparencyTracer
    receivers: Receivers
    pilot: ImportancePilot
    direct: DirectLight
    settings: LiveSettings
    plan: Plan
    vertices: Links
    sides: Links
    reached: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    found: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    unlit: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    caustics: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.float32))

    @staticmethod
    def of(
        scene: Scene,
        tracer: TransparencyTracer,
        receivers: Receivers,
        pilot: ImportancePilot,
        direct: DirectLight,
        settings: LiveSettings,
        plan: Plan,
    ) -> "Linking":
        """No links yet; of more vertices than are asked for each has fewer, so that they are as many in all.

        Raises
        ------
        BakeError
            If the least of them take more memory than they may.
        """
        n, n_sides = len(receivers), 2 * len(pilot.elements)
        spare = settings.memory * 10**6 - n_sides * settings.n_element_links * BYTES
        affordable = spare // (n * BYTES) // _BLOCK * _BLOCK
        if affordable < _BLOCK:
            least = (settings.memory * 10**6 - spare + n * BYTES * _BLOCK) / 1e6
            raise BakeError(
                f"Live light of {n:,} vertices takes {least:,.0f} MB at least, and may take {settings.memory:,}: "
                "raise its Memory, or lower its Vertices."
            )
        n_links = int(min(settings.n_links, affordable, max(settings.of_each(settings.n_links, n), _BLOCK)))
        links = Links.none(n, n_links), Links.none(n_sides, settings.n_element_links)
        return Linking(scene, tracer, receivers, pilot, direct, settings, plan, *links)

    @property
    def key_of_sides(self) -> np.uint64:
        """What `side_ray` takes for the points of sides."""
        return path_key(self.settings.seed, _OF_SIDES)

    @property
    def key_of_vertices(self) -> np.uint64:
        """What `vertex_ray` takes."""
        return path_key(self.settings.seed, _OF_VERTICES)

    def met(self) -> LinkLight:
        """What rays meet, for one call of a kernel."""
        hidden, elements = self.pilot.hidden, self.pilot.elements.arrays
        of_object = hidden.of_object if hidden.any else np.zeros(0, bool)
        seen = self.tracer.arrays, new_ray(), elements, of_object, self._reach
        return LinkLight(*seen, self.direct.arrays, self.caustics)

    @cached_property
    def _reach(self) -> np.ndarray:
        reach: np.ndarray = (NEAR * np.sqrt(self.pilot.elements.areas)).astype(np.float32)
        return reach

    # --- tracing ------------------------------------------------------------------------------------------------

    def trace_vertices(self) -> Job:
        """A block of links of all vertices, and then those of sides that these are the first to end on."""
        links = self.vertices
        first, last = links.n_traced, min(links.n_traced + max(_BLOCK, links.n_traced // _GROWTH), links.n_most)

        def done() -> None:
            links.n_traced = last
            links.renewed_to(last)
            self.reach(links.end[:, first:last])

        return Job(len(self.receivers), last - first, self._vertex_tracer(first, last, False), done)

    def trace_sides(self) -> Job:
        """A block of links of all sides that are reached."""
        links, sides = self.sides, self.reached
        first, last = links.n_traced, min(links.n_traced + _SIDE_BLOCK, links.n_most)

        def done() -> None:
            links.n_traced = last
            links.renewed_to(last)
            self.reach(links.end[sides, first:last])

        return Job(len(sides), last - first, self._side_tracer(sides, first, last, False), done)

    def reach(self, ends: np.ndarray) -> None:
        """Trace the links of sides that are reached for the first time before all else."""
        found = np.zeros(len(self.sides.end), bool)
        found[ends[ends >= 0]] = True
        if self.scene.materials.has(Lobe.TRANSLUCENT).any():
            found |= found.reshape(-1, 2)[:, ::-1].ravel()  # either side may shine through to the other
        found[self.found] = True
        found[self.reached] = False
        self.found = np.flatnonzero(found)
        if len(self.found):
            self.plan.next(self.trace_found)

    def trace_found(self) -> Job:
        """The links of sides that are found, as many as others have, and then those of sides that these end on."""
        new, links = self.found, self.sides
        if links.n_traced == 0:
            links.n_traced = links.n_renewed = min(_SIDE_BLOCK, links.n_most)
        last = links.n_traced

        def done() -> None:
            self.reached, self.unlit = (np.concatenate([of, new]) for of in (self.reached, self.unlit))
            self.found = new[:0]
            self.reach(links.end[new, :last])

        return Job(len(new), last, self._side_tracer(new, 0, last, False), done)

    def _vertex_tracer(self, first: int, last: int, stale: bool) -> Callable[[slice], None]:
        links, at = self.vertices, self.receivers
        how = stratified_set(links.n_most), self.key_of_vertices

        def trace(chunk: slice) -> None:
            rows = chunk.start, chunk.stop, first, last, stale, links.arrays
            trace_vertex_links(self.met(), at.position, at.normal, *how, *rows)

        return trace

    def _side_tracer(self, sides: np.ndarray, first: int, last: int, stale: bool) -> Callable[[slice], None]:
        links = self.sides
        how = stratified_set(links.n_most), self.key_of_sides

        def trace(chunk: slice) -> None:
            rows = chunk.start, chunk.stop, first, last, stale, links.arrays
            trace_side_links(self.met(), sides, *how, *rows)

        return trace

    # --- what is stale -------------------------------------------------------------------------------------------

    def marking(self, object_: int, objects: np.ndarray, boxes: np.ndarray, rest: bool) -> list[Callable[[], Job]]:
        """Jobs that mark stale links after an object has moved, before which those may not be taken.

        Parameters
        ----------
        object_ : int
        objects : (n,) int32
            Object of each vertex.
        boxes : (b, 2, 3) float32, m
            Around the object, where it was and is.
        rest : bool
            Whether to mark those that the first light is not made of, or the others.
        """
        sides, of_vertices, of_sides, at = self.reached, self.vertices, self.sides, self.receivers
        points = stratified_set(of_vertices.n_most), self.key_of_vertices
        side_points = stratified_set(of_sides.n_most), self.key_of_sides
        scene, elements = self.tracer.arrays.scene, self.pilot.elements.arrays

        def part(links: Links, block: int) -> tuple[int, int]:
            middle = min(max(links.n_first, block), links.n_traced)
            return (middle, links.n_traced) if rest else (0, middle)

        of_vertex, of_side = part(of_vertices, _BLOCK), part(of_sides, _SIDE_BLOCK)

        def mark_vertices(chunk: slice) -> None:
            rows = chunk.start, chunk.stop, *of_vertex, of_vertices.arrays
            mark_vertex_links(at.position, at.normal, objects, *points, object_, boxes, *rows)

        def mark_sides(chunk: slice) -> None:
            rows = sides, chunk.start, chunk.stop, *of_side, of_sides.arrays
            mark_side_links(scene, elements, *side_points, object_, boxes, *rows)

        n_rays = [1 + (last - first) // _CHECKS for first, last in (of_vertex, of_side)]
        return [
            lambda: Job(len(objects), n_rays[0], mark_vertices),
            lambda: Job(len(sides), n_rays[1], mark_sides),
        ]

    def mark_followed(self) -> Job:
        """Mark links that were followed, which may be stale whatever has changed."""
        vertices, sides = np.arange(len(self.receivers)), self.reached

        def mark(chunk: slice) -> None:
            for rows, links in ((vertices, self.vertices), (sides, self.sides)):
                part = slice(min(chunk.start, len(rows)), min(chunk.stop, len(rows)))
                mark_followed(rows, part.start, part.stop, links.n_traced, links.arrays)

        n_rays = 1 + self.vertices.n_traced // _CHECKS**2
        return Job(max(len(vertices), len(sides)), n_rays, mark)

    def renew(self) -> None:
        """Say that marked links are to be traced anew, from the first of each row on."""
        self.vertices.n_renewed = self.sides.n_renewed = 0

    def renew_vertices(self) -> Job:
        """Trace anew those links of a block that are stale."""
        links = self.vertices
        first, last = links.n_renewed, min(max(_BLOCK, 2 * links.n_renewed), links.n_traced)

        def done() -> None:
            ends = links.end[links.arrays.split, first:last]
            links.renewed_to(last)
            self.reach(ends)

        return Job(len(self.receivers), last - first, self._vertex_tracer(first, last, True), done)

    def renew_sides(self) -> Job:
        """The same of the sides."""
        links, sides = self.sides, self.reached
        first, last = links.n_renewed, min(max(_SIDE_BLOCK, 2 * links.n_renewed), links.n_traced)

        def done() -> None:
            ends = links.end[links.arrays.split, first:last]
            links.renewed_to(last)
            self.reach(ends)

        return Job(len(sides), last - first, self._side_tracer(sides, first, last, True), done)
