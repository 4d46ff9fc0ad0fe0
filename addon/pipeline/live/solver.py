"""What is known of the light of a scene, and the next step to know it better. Without threads of its own."""

from dataclasses import replace

import numpy as np

from ...core.sampling.path_numbers import path_key
from ...emitters import light_sources, region_of
from ...gather import DirectLight
from ...scene import Scene
from ...settings.live import LiveSettings
from ...tracing import EmbreeTracer, TransparencyTracer
from .crew import Crew, Task
from .edits import Edit, LampsChanged, MaterialsChanged, ObjectMoved, SceneReplaced, WorldChanged
from .light import LiveLight
from .surfaces import LiveSurfaces

_DIRECT = 61  # stream of random numbers
_CHUNK = 1 << 10  # receivers


class Solver:
    """The light of a scene at the vertices of its surfaces: after each step it is known a little better.

    Its light depends on the scene, the edits and the seed alone, not on the time or the number of threads.
    """

    def __init__(self, scene: Scene, surfaces: LiveSurfaces, settings: LiveSettings, crew: Crew) -> None:
        self._settings, self._crew = settings, crew
        self._set_up(scene, surfaces)

    def _set_up(self, scene: Scene, surfaces: LiveSurfaces) -> None:
        self._scene, self._surfaces = scene, surfaces
        self._receivers = surfaces.receivers()
        self._objects = surfaces.object_of_vertex
        self._tracer = TransparencyTracer(scene, EmbreeTracer(scene))
        self._relight()

    def _relight(self) -> None:
        """Begin anew with the direct light."""
        self._sum, self._n_passes = np.zeros((len(self._receivers), 3)), 0
        self._task = Task(len(self._receivers))
        self._direct = self._direct_light()

    def _direct_light(self) -> DirectLight | None:
        if len(self._receivers) == 0:
            return None
        sources = light_sources(self._scene, region_of(self._receivers.position))
        return DirectLight(self._scene, self._tracer, sources)

    def apply(self, edits: list[Edit]) -> None:
        """Take edits in; what they leave of the light stays."""
        for edit in edits:
            match edit:
                case SceneReplaced(scene, surfaces):
                    self._set_up(scene, surfaces)
                case LampsChanged(lights):
                    self._scene = replace(self._scene, lights=lights)
                case WorldChanged(world):
                    self._scene = replace(self._scene, world=world)
                case MaterialsChanged(materials):
                    self._scene = replace(self._scene, materials=materials)
                    self._tracer = TransparencyTracer(self._scene, self._tracer.surfaces)
                case ObjectMoved():
                    pass  # not followed yet
        self._relight()

    @property
    def converged(self) -> bool:
        """Whether no step would change the light."""
        return self._direct is None or self._n_passes >= self._settings.n_direct

    def step(self) -> None:
        """Know the light a little better.

        Raises
        ------
        Halted
            If that was asked for; the step goes on from there when it is called again.
        """
        if self.converged or self._direct is None:
            return
        direct, n = self._direct, len(self._receivers)
        key, at = path_key(self._settings.seed, _DIRECT, self._n_passes), self._receivers

        def light(chunk: slice) -> None:
            of = at.position[chunk], at.normal[chunk], self._objects[chunk]
            self._sum[chunk] += direct.mean_irradiance(*of, 1, key, chunk.start)

        self._crew.run(self._task, _CHUNK, light)
        self._task, self._n_passes = Task(n), self._n_passes + 1

    def light(self, version: int, since: float) -> LiveLight:
        """What is known of it now."""
        direct = (self._sum / (np.pi * max(self._n_passes, 1))).astype(np.float32)
        dark = np.zeros_like(direct)
        return LiveLight(version, self._surfaces, direct, dark, np.inf, since, self.converged)
