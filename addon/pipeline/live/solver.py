"""What is known of the light of a scene, and the next step to know it better. Without threads of its own."""

import numpy as np

from ...core.sampling.path_numbers import path_key
from ...emitters import light_sources, region_of
from ...gather import DirectLight, importance_pilot
from ...scene import Scene
from ...settings.live import LiveSettings
from ...tracing import TransparencyTracer
from .crew import Crew
from .edits import Edit, LampsChanged, MaterialsChanged, ObjectMoved, SceneReplaced, WorldChanged
from .jobs import Job, Plan
from .light import LiveLight
from .moving import Moving
from .state import lit_otherwise, made_otherwise, paths_stay, tracer_of
from .surfaces import LiveSurfaces
from .thinned import Thinned
from .transport.bounces import Transport
from .transport.lighting import Lighting
from .transport.linking import Linking
from .transport.reflectance import Reflectance, reflectance

_OF_AREA = 115  # stream of random numbers
_PASSES = 2  # estimates of direct light that a step adds
_FIRST_LINKS = 256  # of a vertex that the first light after an edit is taken from
_FEW_BOUNCES = 2
_STILL = 1e-4  # relative change of what bounces that is none


class Solver:
    """The light of a scene at the vertices of its surfaces: after each step it is known a little better.

    Its light depends on the scene, the edits and the seed alone, not on the time or the number of threads.

    Attributes
    ----------
    converged : bool
        Whether no step would change the light.
    """

    def __init__(self, scene: Scene, surfaces: LiveSurfaces, settings: LiveSettings, crew: Crew) -> None:
        self._settings, self._crew, self._plan, self._planned = settings, crew, Plan(), False
        self._set_up(scene, surfaces)

    # --- what is built once for a scene -------------------------------------------------------------------------

    def _set_up(self, scene: Scene, surfaces: LiveSurfaces) -> None:
        self._scene, self._surfaces = scene, surfaces
        self._thinned = Thinned.of(surfaces, self._settings.n_vertices)
        chosen = self._thinned.chosen
        self._receivers, self._objects = surfaces.receivers().where(chosen), surfaces.object_of_vertex[chosen]
        n = len(self._receivers)
        self._plan.drop()
        self._empty = n == 0 or scene.n_triangles == 0
        self._indirect, self._variance = np.zeros((n, 3), np.float32), np.full(n, np.inf, np.float32)
        self.converged, self._lit = self._empty, False
        if self._empty:
            return
        self._region = region_of(self._receivers.position)
        self._tracer = tracer_of(scene, self._crew.progress)
        self._moving = Moving(self._receivers, self._objects)
        self._start_links()

    def _start_links(self) -> None:
        """No links are there yet."""
        settings, crew, receivers = self._settings, self._crew, self._receivers
        region, n_elements = self._region, settings.n_elements
        pilot = importance_pilot(self._scene, self._tracer, receivers, region, n_elements, crew.workers)
        self._unmarked: list[tuple[int, np.ndarray]] = []
        how = settings, self._plan, self._light_new
        self._linking = Linking.of(self._scene, self._tracer, receivers, pilot, self._direct(), *how)
        self._transport = Transport(len(self._linking.sides.end), crew)
        self._reflectance: Reflectance | None = None
        self._lighting = Lighting.of(self._tracer, receivers, self._objects, self._linking, settings)

    def _direct(self) -> DirectLight:
        """What gives light, as it is now."""
        return DirectLight(self._scene, self._tracer, light_sources(self._scene, self._region))

    def _light_new(self, sides: np.ndarray) -> None:
        """Sides are reached for the first time."""
        self._plan.next(lambda: self._lighting.light_new(sides))

    # --- edits --------------------------------------------------------------------------------------------------

    def apply(self, edits: list[Edit]) -> None:
        """Take edits in; what they leave of the light stays."""
        if any(isinstance(edit, SceneReplaced) for edit in edits) or not self._empty:
            self._plan.drop()
        for edit in edits:
            if isinstance(edit, SceneReplaced):
                self._set_up(edit.scene, edit.surfaces)
            elif not self._empty:
                self._take(edit)
        if not self._empty:
            self._lighting.again()
            self._planned = False
            self.converged = self._lit = False

    def _take(self, edit: Edit) -> None:
        """Take one edit in."""
        if isinstance(edit, ObjectMoved):
            self._move(edit)
            return
        if isinstance(edit, LampsChanged):
            self._scene = lit_otherwise(self._scene, lights=edit.lights)
        elif isinstance(edit, WorldChanged):
            self._scene = lit_otherwise(self._scene, world=edit.world)
        elif isinstance(edit, MaterialsChanged):
            stay = paths_stay(self._scene.materials, edit.materials)
            self._scene = made_otherwise(self._scene, edit.materials)
            self._reflectance = None
            progress = self._crew.progress
            self._trace_by(self._tracer.lit_by(self._scene) if stay else tracer_of(self._scene, progress))
            if stay:
                self._unmarked.append((-1, np.zeros((0, 2, 3), np.float32)))
            else:
                self._moving.restart()
                self._start_links()
        self._linking.direct = self._direct()

    def _move(self, edit: ObjectMoved) -> None:
        """An object stands elsewhere."""
        self._scene, tracer, boxes = self._moving.move(self._scene, self._tracer, edit)
        self._trace_by(tracer)
        self._unmarked.append((edit.object, boxes))
        if self._scene.shines[self._scene.object_of_triangle == edit.object].any():
            self._linking.direct = self._direct()

    def _trace_by(self, tracer: TransparencyTracer) -> None:
        self._tracer = self._linking.tracer = self._lighting.tracer = tracer
        self._linking.scene = self._scene

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
        if not self._planned:
            self._make_plan()
        self._plan.work(self._crew)
        self._carry()
        self._planned = False

    def _make_plan(self) -> None:
        """The parts of the next step: links to be marked, traced anew or for the first time; then direct light."""
        linking, lighting, then = self._linking, self._lighting, self._plan.then
        self._planned, n = True, _PASSES if self._lit else 1
        for moved in self._unmarked:
            for job in linking.moved(moved[0], self._objects, moved[1]):
                then(job)
        if self._unmarked:
            then(lambda: Job(0, 1, _nothing, self._unmarked.clear))
        stale = bool(self._unmarked)
        if stale or linking.vertices.stale:
            then(linking.renew_vertices)
        elif not linking.vertices.n_traced or (self._lit and not linking.vertices.finished):
            then(linking.trace_vertices)
        if stale or linking.sides.stale:
            then(linking.renew_sides)
        elif self._lit and not linking.sides.finished:
            then(linking.trace_sides)
        if not lighting.sides.finished:
            then(lambda: lighting.light_sides(n))
        if not lighting.vertices.finished:
            then(lambda: lighting.light_vertices(n))
        if not lighting.near_sides.finished:
            then(lambda: lighting.light_near_sides(n))
        if not lighting.near_vertices.finished:
            then(lambda: lighting.light_near_vertices(4 * n))

    def _carry(self) -> None:
        """From direct light and links to what vertices gather."""
        linking, lighting = self._linking, self._lighting
        if self._reflectance is None:
            key = path_key(self._settings.seed, _OF_AREA)
            self._reflectance = reflectance(self._tracer, linking.pilot.elements, key, self._crew)
        lit = lighting.sides.mean, lighting.near_sides.mean
        of, change = (*lit, linking.sides, linking.reached, self._reflectance), 1.0
        if not self._lit:
            self._transport.restart(self._settings.n_bounces, *of)
        else:
            for _ in range(_FEW_BOUNCES):
                change = self._transport.bounce(*of)
        self._transport.radiate(of[0], self._reflectance)
        n_links = linking.vertices.n_traced if self._lit else min(linking.vertices.n_traced, _FIRST_LINKS)
        self._transport.to_vertices(linking.vertices, n_links, self._indirect, self._variance)
        self._indirect += lighting.near_vertices.mean
        finished = linking.vertices.finished and linking.sides.finished and lighting.finished
        self.converged = self._lit and finished and change < _STILL
        self._lit = True

    # --- what is known ------------------------------------------------------------------------------------------

    def light(self, version: int, since: float) -> LiveLight:
        """What is known of it now."""
        if self._empty:
            dark = np.zeros((len(self._surfaces), 3), np.float32)
            return LiveLight(version, self._surfaces, dark, dark, 0.0, since, True)
        mean = float(self._indirect.mean(dtype=np.float64))
        error = float(np.sqrt(self._variance.mean(dtype=np.float64))) / mean if mean > 0 else 0.0
        direct, indirect = (self._thinned.spread(of) for of in (self._lighting.vertices.mean, self._indirect))
        return LiveLight(version, self._surfaces, direct, indirect, error, since, self.converged)


def _nothing(_: slice) -> None:
    pass
