"""What is known of the light of a scene, and the next step to know it better. Without threads of its own."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...core.sampling.path_numbers import path_key
from ...emitters import light_sources, region_of
from ...gather import DirectLight, importance_pilot
from ...gather.direct.ray_directions import stratified_set
from ...scene import Lobe, Scene
from ...settings.live import LiveSettings
from ...tracing.embree import new_ray
from .crew import Crew, Task
from .direct import Estimates, light_sides, light_vertices
from .edits import Edit, LampsChanged, MaterialsChanged, ObjectMoved, SceneReplaced, WorldChanged
from .light import LiveLight
from .links import Links, trace_side_links, trace_vertex_links
from .reflectance import Reflectance, reflectance
from .state import lit_otherwise, made_otherwise, paths_stay, tracer_of
from .surfaces import LiveSurfaces
from .transport import Transport

_OF_VERTICES, _OF_SIDES, _OF_AREA, _LIGHT_VERTICES, _LIGHT_SIDES = range(61, 66)  # streams of random numbers
_BLOCK, _SIDE_BLOCK, _PASSES = 16, 8, 2  # links of a row and estimates that a step adds at least
_GROWTH = 4  # a step adds to a row this part of the links that are there
_CHUNK = 1 << 12  # rays
_FIRST_LINKS = 256  # of a vertex that the first light after an edit is taken from
_STILL = 1e-4  # relative change of what bounces that is none
_FEW_BOUNCES = 2


@dataclass
class _Job:
    """A part of a step: it is called until it returns, and goes on where it was halted."""

    task: Task
    size: int
    work: Callable[[slice], object]
    done: Callable[[], object] = lambda: None


def _rows(n_rays: int) -> int:
    """Rows of so many rays that a chunk has, between two of which a halt is heeded."""
    return max(1, _CHUNK // max(n_rays, 1))


class Solver:
    """The light of a scene at the vertices of its surfaces: after each step it is known a little better.

    Its light depends on the scene, the edits and the seed alone, not on the time or the number of threads.

    Attributes
    ----------
    converged : bool
        Whether no step would change the light.
    """

    def __init__(self, scene: Scene, surfaces: LiveSurfaces, settings: LiveSettings, crew: Crew) -> None:
        self._settings, self._crew = settings, crew
        self._keys = {stream: path_key(settings.seed, stream) for stream in range(_OF_VERTICES, _LIGHT_SIDES + 1)}
        self._job: _Job | None = None
        self._plan: deque[Callable[[], _Job]] = deque()
        self._set_up(scene, surfaces)

    # --- what is built once for a scene -------------------------------------------------------------------------

    def _set_up(self, scene: Scene, surfaces: LiveSurfaces) -> None:
        self._scene, self._surfaces = scene, surfaces
        self._receivers, self._objects = surfaces.receivers(), surfaces.object_of_vertex
        n = len(self._receivers)
        self._drop_plan()
        self._empty = n == 0 or scene.n_triangles == 0
        self._indirect, self._variance = np.zeros((n, 3), np.float32), np.full(n, np.inf, np.float32)
        self.converged, self._lit = self._empty, False
        if self._empty:
            return
        self._region = region_of(self._receivers.position)
        self._tracer = tracer_of(scene, self._crew.progress)
        at = self._receivers, self._region, self._settings.n_elements, self._crew.workers
        pilot = importance_pilot(scene, self._tracer, *at)
        self._elements, hidden = pilot.elements, pilot.hidden
        self._hidden = hidden.of_object if hidden.any else np.zeros(0, bool)
        self._start_links()
        self._estimates = Estimates.none(n, self._settings.n_direct, False)
        n_sides, n_links = self._side_links.end.shape
        self._side_estimates = Estimates.none(n_sides, n_links, True)
        self._restart_light()

    def _start_links(self) -> None:
        """No links are there yet."""
        n, n_sides, settings = len(self._receivers), 2 * len(self._elements), self._settings
        scene = self._scene
        materials = scene.materials
        of_triangles = materials.directional | materials.see_through
        weighted = bool(of_triangles[scene.material_of_triangle].any()) or self._tracer.arrays.coincident.any
        a_link, a_side_link = (20, 36) if weighted else (8, 24)  # bytes
        spare = settings.memory * 10**6 - n_sides * settings.n_element_links * a_side_link
        affordable = max(spare, 0) // (n * a_link) // _BLOCK * _BLOCK
        n_links = int(max(_BLOCK, min(settings.n_links, affordable)))
        self._links = Links.none(n, n_links, weighted)
        self._side_links = Links.none(n_sides, settings.n_element_links, weighted)
        self._sides = np.zeros(0, np.int64)
        self._transport = Transport(n_sides, self._crew)
        self._reflectance: Reflectance | None = None
        self._lets_through = bool(materials.has(Lobe.TRANSLUCENT).any())

    def _restart_light(self) -> None:
        """Lamps, emission or the world are others."""
        sources = light_sources(self._scene, self._region)
        self._direct = DirectLight(self._scene, self._tracer, sources)

    # --- edits --------------------------------------------------------------------------------------------------

    def apply(self, edits: list[Edit]) -> None:
        """Take edits in; what they leave of the light stays."""
        for edit in edits:
            if isinstance(edit, SceneReplaced):
                self._set_up(edit.scene, edit.surfaces)
            elif not self._empty:
                self._take(edit)
        if not self._empty:
            self._drop_plan()
            self._estimates.again()
            self._side_estimates.again()
            self.converged = self._lit = False

    def _take(self, edit: Edit) -> None:
        """Take one edit in."""
        if isinstance(edit, LampsChanged):
            self._scene = lit_otherwise(self._scene, lights=edit.lights)
        elif isinstance(edit, WorldChanged):
            self._scene = lit_otherwise(self._scene, world=edit.world)
        elif isinstance(edit, MaterialsChanged):
            stay = paths_stay(self._scene.materials, edit.materials)
            self._scene = made_otherwise(self._scene, edit.materials)
            self._tracer = self._tracer.lit_by(self._scene) if stay else tracer_of(self._scene, self._crew.progress)
            self._reflectance = None
            if not stay:
                self._start_links()
        elif isinstance(edit, ObjectMoved):
            return  # not followed yet
        self._restart_light()

    # --- steps --------------------------------------------------------------------------------------------------

    def step(self) -> None:
        """Know the light a little better; after an edit, the first light that knows of it.

        Raises
        ------
        Cancelled
            If a halt was asked for; the step goes on from there when it is called again.
        """
        if self.converged:
            return
        if self._job is None and not self._plan:
            self._make_plan()
        while self._job is not None or self._plan:
            job = self._job = self._job or self._plan.popleft()()
            self._crew.run(job.task, job.size, job.work)
            self._job = None
            job.done()
        self._carry()

    def _drop_plan(self) -> None:
        """Leave what a halted step had still to do."""
        self._job = None
        self._plan.clear()

    def _make_plan(self) -> None:
        """The parts of the next step."""
        links, side_links, n = self._links, self._side_links, _PASSES if self._lit else 1
        if links.n_traced == 0 or (self._lit and not links.finished):
            self._plan.append(self._trace_vertices)
        if self._lit and not side_links.finished:
            self._plan.append(self._trace_sides)
        if not self._side_estimates.finished:
            self._plan.append(lambda: self._light_sides(n))
        if not self._estimates.finished:
            self._plan.append(lambda: self._light_vertices(n))

    def _carry(self) -> None:
        """From direct light and links to what vertices gather."""
        if self._reflectance is None:
            self._reflectance = reflectance(self._tracer, self._elements, self._keys[_OF_AREA], self._crew)
        of = self._side_estimates.mean, self._side_links, self._sides, self._reflectance
        n, change = self._settings.n_bounces, 1.0
        if not self._lit:
            self._transport.restart(n, *of)
        else:
            for _ in range(_FEW_BOUNCES):
                change = self._transport.bounce(*of)
        self._transport.radiate(of[0], self._reflectance)
        n_links = self._links.n_traced if self._lit else min(self._links.n_traced, _FIRST_LINKS)
        self._transport.to_vertices(self._links, n_links, self._indirect, self._variance)
        left = self._links, self._side_links, self._estimates, self._side_estimates
        self.converged = self._lit and all(one.finished for one in left) and change < _STILL
        self._lit = True

    # --- parts of steps -----------------------------------------------------------------------------------------

    def _trace_vertices(self) -> _Job:
        """A block of links of all vertices, and then those of sides that these are the first to end on."""
        links, at = self._links, self._receivers
        first, last = links.n_traced, min(links.n_traced + max(_BLOCK, links.n_traced // _GROWTH), links.end.shape[1])
        tracing = self._tracer.arrays, self._elements.arrays, self._hidden
        how = stratified_set(links.end.shape[1]), self._keys[_OF_VERTICES]

        def trace(chunk: slice) -> None:
            rows = chunk.start, chunk.stop, first, last, links.end, links.length, links.weight
            trace_vertex_links(tracing[0], new_ray(), *tracing[1:], at.position, at.normal, *how, *rows)

        def done() -> None:
            links.n_traced = last
            self._reach(links.end[:, first:last])

        return _Job(Task(len(at)), _rows(last - first), trace, done)

    def _trace_sides(self) -> _Job:
        """A block of links of all sides that are reached."""
        links, sides = self._side_links, self._sides
        first, last = links.n_traced, min(links.n_traced + _SIDE_BLOCK, links.end.shape[1])

        def done() -> None:
            links.n_traced = last
            self._reach(links.end[sides, first:last])

        return _Job(Task(len(sides)), _rows(last - first), self._side_tracer(sides, first, last), done)

    def _reach(self, ends: np.ndarray) -> None:
        """Trace the links of sides that are reached for the first time, and light them, before all else."""
        reached = np.zeros(len(self._side_links.end), bool)
        reached[ends[ends >= 0]] = True
        reached |= reached.reshape(-1, 2)[:, ::-1].ravel() & self._lets_through
        reached[self._sides] = False
        sides = np.flatnonzero(reached)
        if len(sides) == 0:
            return
        links = self._side_links
        last = links.n_traced = max(links.n_traced, 2 * _SIDE_BLOCK)
        self._sides = np.concatenate([self._sides, sides])
        n_fresh = self._side_estimates.n_fresh

        def reach_on() -> None:
            self._reach(links.end[sides, :last])

        lighter = self._side_lighter(sides, 0, n_fresh)
        if n_fresh:
            self._plan.appendleft(lambda: _Job(Task(len(sides)), _rows(n_fresh), lighter))
        tracer = self._side_tracer(sides, 0, last)
        self._plan.appendleft(lambda: _Job(Task(len(sides)), _rows(last), tracer, reach_on))

    def _side_tracer(self, sides: np.ndarray, first: int, last: int) -> Callable[[slice], None]:
        """What traces links of some sides."""
        links, arrays = self._side_links, (self._tracer.arrays, self._elements.arrays, self._hidden)
        how = stratified_set(links.end.shape[1]), self._keys[_OF_SIDES]

        def trace(chunk: slice) -> None:
            rows = chunk.start, chunk.stop, first, last, links.end, links.length, links.weight
            trace_side_links(arrays[0], new_ray(), *arrays[1:], sides, *how, *rows)

        return trace

    def _side_lighter(self, sides: np.ndarray, first: int, last: int) -> Callable[[slice], None]:
        """What makes estimates of the direct light of some sides."""
        links, of = self._side_links, self._side_estimates.arrays
        arrays = self._direct.arrays, self._tracer.arrays
        how = stratified_set(links.end.shape[1]), self._keys[_LIGHT_SIDES], self._keys[_OF_SIDES], sides, links.end
        elements = self._elements.arrays

        def light(chunk: slice) -> None:
            light_sides(*arrays, new_ray(), elements, *how, chunk.start, chunk.stop, first, last, of)

        return light

    def _light_sides(self, n: int) -> _Job:
        """N more estimates of the direct light of all sides that are reached, as far as they have links."""
        estimates = self._side_estimates
        first = estimates.n_fresh
        last = min(first + n, max(self._side_links.n_traced, first))

        def done() -> None:
            estimates.n_fresh = last

        return _Job(Task(len(self._sides)), _rows(n), self._side_lighter(self._sides, first, last), done)

    def _light_vertices(self, n: int) -> _Job:
        """N more estimates of the direct light of all vertices."""
        estimates, at, key = self._estimates, self._receivers, self._keys[_LIGHT_VERTICES]
        first, last = estimates.n_fresh, min(estimates.n_fresh + n, estimates.n_most)
        arrays, objects = (self._direct.arrays, self._tracer.arrays), self._objects

        def light(chunk: slice) -> None:
            place = at.position, at.normal, objects, key, chunk.start, chunk.stop
            light_vertices(*arrays, new_ray(), *place, first, last, estimates.arrays)

        def done() -> None:
            estimates.n_fresh = last

        return _Job(Task(len(at)), _rows(n), light, done)

    # --- what is known ------------------------------------------------------------------------------------------

    def light(self, version: int, since: float) -> LiveLight:
        """What is known of it now."""
        if self._empty:
            dark = np.zeros((len(self._surfaces), 3), np.float32)
            return LiveLight(version, self._surfaces, dark, dark, 0.0, since, True)
        mean = float(self._indirect.mean(dtype=np.float64))
        error = float(np.sqrt(self._variance.mean(dtype=np.float64))) / mean if mean > 0 else 0.0
        direct, indirect = self._estimates.mean.copy(), self._indirect.copy()
        return LiveLight(version, self._surfaces, direct, indirect, error, since, self.converged)
