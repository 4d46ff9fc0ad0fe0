"""What is known of the light of a scene, and the next step to know it better. Without threads of its own."""

import numpy as np

from ...core.sampling.path_numbers import path_key
from ...emitters import light_sources, region_of
from ...gather import DirectLight, importance_pilot
from ...scene import Materials, Scene
from ...settings.live import LiveSettings
from ...tracing import TransparencyTracer
from .crew import Crew
from .edits import (
    Edit,
    LampsChanged,
    MaterialsChanged,
    ObjectReshaped,
    ObjectShown,
    OfObject,
    SceneReplaced,
    WorldChanged,
)
from .jobs import Plan, no_job
from .light import LiveLight
from .moving import Moving
from .photons.caustics import Caustics
from .photons.makers import makes_caustics
from .state import lights_stay, lit_otherwise, made_otherwise, painted, paths_stay, tracer_of
from .surfaces import LiveSurfaces
from .thinned import Thinned
from .transport.bounces import Transport
from .transport.lighting import Lighting
from .transport.linking import Linking
from .transport.reflectance import Reflectance
from .transport.unmarked import Unmarked

_OF_AREA = 115  # stream of random numbers
_PASSES = 2  # estimates of direct light that a step adds
_FIRST_BOUNCES, _FEW_BOUNCES = 3, 2  # of what an edit has changed, and of each step after it
_MOST_TIMES = 5  # as many vertices as are asked for find light, all with fewer links, where a scene has them
_N_NEAR = 4  # estimates of what is near that a step adds to each of so many vertices, and fewer to each of more
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
        self._thinned = Thinned.of(surfaces, _MOST_TIMES * self._settings.n_vertices)
        chosen = self._thinned.chosen
        self._receivers, self._objects = surfaces.receivers().where(chosen), surfaces.object_of_vertex[chosen]
        n = len(self._receivers)
        self._plan.drop()
        self._empty = n == 0 or scene.n_triangles == 0
        self._indirect, self._variance = np.zeros((n, 3), np.float32), np.full(n, np.inf, np.float32)
        self.converged, self._lit = self._empty, False
        if self._empty:
            return
        self._n_near = max(self._settings.of_each(_N_NEAR, n), 1)
        self._region = region_of(self._receivers.position)
        self._moving = Moving(self._receivers, self._objects, chosen, len(scene.objects.names))
        self._start_links(scene, tracer_of(scene, self._crew.progress))

    def _start_links(self, scene: Scene, tracer: TransparencyTracer) -> None:
        """No links are there yet of a scene; where a halt comes, all stays as it is."""
        settings, crew, receivers = self._settings, self._crew, self._receivers
        region, n_elements = self._region, settings.n_elements
        pilot = importance_pilot(scene, tracer, receivers, region, n_elements, crew.workers)
        self._scene, self._tracer = scene, tracer
        self._first_unmarked, self._rest_unmarked = Unmarked(), Unmarked()
        self._linking = Linking.of(scene, tracer, receivers, pilot, self._direct(), settings, self._plan)
        n_sides = len(self._linking.sides.end)
        self._transport, self._whole = Transport(n_sides, len(receivers), crew), False
        self._reflectance, self._painted = Reflectance.none(n_sides), np.ones(len(scene.materials), bool)
        self._lighting = Lighting.of(tracer, receivers, self._objects, self._linking, settings)
        self._caustics: Caustics | None = None
        if makes_caustics(scene):
            at = receivers, self._objects, pilot.elements, region
            self._caustics = Caustics(scene, tracer, *at, settings)

    def _direct(self) -> DirectLight:
        """What gives light, as it is now."""
        return DirectLight(self._scene, self._tracer, light_sources(self._scene, self._region))

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
        self._planned = False
        self.converged, self._lit = self._empty, False

    def _take(self, edit: Edit) -> None:
        """Take one edit in."""
        relit = True
        if isinstance(edit, OfObject):
            self._move(edit)
        elif isinstance(edit, MaterialsChanged):
            relit = self._paint(edit.materials)
        else:
            if isinstance(edit, LampsChanged):
                self._scene = lit_otherwise(self._scene, lights=edit.lights)
            elif isinstance(edit, WorldChanged):
                self._scene = lit_otherwise(self._scene, world=edit.world)
            self._linking.direct = self._direct()
        if relit:
            self._lighting.again(near=False)
        self._lighting.again(near=True)
        if self._caustics:
            self._caustics.edited(self._scene, self._tracer)

    def _paint(self, materials: Materials) -> bool:
        """Materials look otherwise; whether direct light has to be found again."""
        old, scene = self._scene.materials, made_otherwise(self._scene, materials)
        if not paths_stay(old, materials):
            tracer = tracer_of(scene, self._crew.progress)
            self._start_links(scene, self._moving.restarted(scene, tracer))
            return True
        self._scene, self._painted = scene, self._painted | painted(old, materials)
        self._trace_by(self._tracer.lit_by(scene))
        self._rest_unmarked.followed = True
        self._linking.direct = self._direct()
        return not lights_stay(old, materials)

    def _move(self, edit: OfObject) -> None:
        """An object stands elsewhere, has another shape, or is gone or there again."""
        self._scene, tracer, boxes = self._moving.take(self._scene, self._tracer, edit)
        self._trace_by(tracer)
        for unmarked in (self._first_unmarked, self._rest_unmarked):
            unmarked.add(edit.object, boxes)
        self._rest_unmarked.followed = True
        own = self._scene.object_of_triangle == edit.object
        if isinstance(edit, ObjectReshaped):
            self._surfaces = edit.surfaces
        if isinstance(edit, ObjectShown):
            self._painted[self._scene.material_of_triangle[own]] = True
        if self._scene.materials.emits[self._scene.material_of_triangle[own]].any():
            self._linking.direct = self._direct()
        if self._caustics:
            self._caustics.moved(edit.object, boxes)

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
        marks = self._first_unmarked.jobs(linking, self._objects, rest=False)
        if self._lit or not self._whole:
            marks += self._rest_unmarked.jobs(linking, self._objects, rest=True)
        if len(linking.found):  # a halt came between
            then(linking.trace_found)
        for job in marks:
            then(job)
        if marks or (self._lit and linking.vertices.stale):
            then(linking.renew_vertices)
        elif not linking.vertices.n_traced or (self._lit and not linking.vertices.finished):
            then(linking.trace_vertices)
        if marks or (self._lit and linking.sides.stale):
            then(linking.renew_sides)
        elif self._lit and not linking.sides.finished:
            then(linking.trace_sides)
        then(lighting.light_new)
        if not lighting.sides.finished:
            then(lambda: lighting.light_sides(n))
        if not lighting.vertices.finished:
            then(lambda: lighting.light_vertices(n))
        if self._caustics:
            for job in self._caustics.jobs():
                then(job)
            then(lambda: no_job(self._light_by_caustics))
        if not lighting.near_sides.finished:
            then(lambda: lighting.light_near_sides(n))
        if not lighting.near_vertices.finished:
            then(lambda: lighting.light_near_vertices(n * self._n_near))

    def _light_by_caustics(self) -> None:
        """Sides take what photons bring."""
        if self._caustics:
            self._linking.caustics = self._caustics.of_sides(self._lighting.sides.coverage)

    def _carry(self) -> None:
        """From direct light and links to what vertices gather; first over few links, if all are known to be more."""
        linking, lighting, transport = self._linking, self._lighting, self._transport
        if self._painted.any():
            key, elements = path_key(self._settings.seed, _OF_AREA), linking.pilot.elements
            self._reflectance.find(self._tracer, elements, key, self._crew, self._painted, self._moving.gone)
            self._painted = np.zeros_like(self._painted)
        on_sides = lighting.sides.mean + linking.caustics if self._caustics else lighting.sides.mean
        lit = on_sides, lighting.near_sides.mean
        of, change = (*lit, linking.sides, linking.reached, self._reflectance), 1.0
        whole = self._lit or not self._whole
        if not self._lit:
            n_most = self._settings.n_bounces
            transport.follow(n_most if whole else min(n_most, _FIRST_BOUNCES), *of, whole)
        else:
            for _ in range(_FEW_BOUNCES):
                change = transport.bounce(*of)
        transport.radiate(of[0], self._reflectance)
        transport.to_vertices(linking.vertices, self._indirect, self._variance, whole)
        self._indirect += lighting.near_vertices.mean
        finished = linking.vertices.finished and linking.sides.finished and lighting.finished
        if self._caustics:
            self._indirect += self._caustics.light()
            self._variance += self._caustics.variance().astype(np.float32)
            finished = finished and self._caustics.finished
        self.converged = self._lit and finished and change < _STILL
        self._lit, self._whole = True, self._whole or whole

    # --- what is known ------------------------------------------------------------------------------------------

    def light(self, version: int, since: float) -> LiveLight:
        """What is known of it now."""
        if self._empty:
            dark = np.zeros((len(self._surfaces), 3), np.float32)
            return LiveLight(version, self._surfaces, dark, dark, 0.0, since, True)
        there = ~self._moving.gone[self._objects]
        mean = float(self._indirect[there].mean(dtype=np.float64)) if there.any() else 0.0
        error = float(np.sqrt(self._variance[there].mean(dtype=np.float64))) / mean if mean > 0 else 0.0
        direct, indirect = (self._thinned.spread(of) for of in (self._lighting.vertices.mean, self._indirect))
        return LiveLight(version, self._surfaces, direct, indirect, error, since, self.converged)
