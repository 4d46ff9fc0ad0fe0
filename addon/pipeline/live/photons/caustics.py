"""Caustics kept alive: which photons an edit may have changed, and what is known of their light meanwhile."""

from collections.abc import Callable
from functools import partial

import numpy as np

from ....emitters import Sphere, light_sources
from ....gather.radiance_cache.elements import SurfaceElements
from ....receivers import Receivers
from ....scene import Scene
from ....settings.live import LiveSettings
from ....tracing import TransparencyTracer
from ..jobs import A_CHUNK, Job, no_job, of_blocks
from .groups import Groups
from .path_tracing import N_IN_ROUND, PathTracing, watts_of
from .paths import (
    KEPT,
    RENEWED,
    STALE,
    WAITING,
    PathArrays,
    differing,
    mark_crossing,
    mark_emission,
    no_paths,
    scale_paths,
)
from .photon_map import N_LEVELS, PhotonMap, level_of_round

_BLOCK, _LARGE_BLOCK = 1 << 11, 1 << 14  # photons that are traced, or looked at, between two looks for a halt
_A_STEP = 1 << 14  # photons that are traced in a step
_BRIGHTER = 256.0  # or darker: the map's unit is then too small or too large
_N_TURNS = 4  # photons of each group that are traced again after an edit
_N_MEASURED = 1 << 6  # receivers around which surfaces' ends are looked for between two looks for a halt


class Caustics:
    """Photons of a scene that makes caustics, and their map.

    After an edit, photons whose paths cross what it moved leave the map and are traced again, in the order of their
    rounds. Each round is a sample of all light: so those that were traced again stand for all that left, and the light
    is that of the edited scene, only noisier, from the first of them on.

    What no box tells of is found as Larsen and Christensen do: one photon of each group is traced again in turn, and
    where its path has changed the whole group is, those groups first that bring most.

    Attributes
    ----------
    paths : PathArrays
    touched : (g,) bool
        Groups of which a photon left the map since the last edit, or was found to be another one.
    n_touched : int
        Photons that left the map since then.
    """

    def __init__(
        self,
        scene: Scene,
        tracer: TransparencyTracer,
        receivers: Receivers,
        objects: np.ndarray,
        elements: SurfaceElements,
        region: Sphere,
        settings: LiveSettings,
    ) -> None:
        self._receivers, self._objects, self._elements = receivers, objects, elements
        self._region, self._settings = region, settings
        self._start(scene, tracer)

    def _start(self, scene: Scene, tracer: TransparencyTracer) -> None:
        """No photon is there yet."""
        self._scene, self._tracer = scene, tracer
        sources = light_sources(scene, self._region)
        self._dark = not sources
        self._boxes: list[np.ndarray] = []
        self._moved: set[int] = set()
        self._edited = self._relit = False
        self._queue: list[int] = []
        self._turn = self._n_turns = 0
        if self._dark:
            return
        n_rounds = max(1, round(self._settings.n_photons / N_IN_ROUND))
        self._tracing = PathTracing(sources, n_rounds, self._elements, self._settings.seed)
        self._tracing.aim(scene, tracer, sources)
        n = self._tracing.n
        self.paths: PathArrays = no_paths(n)
        self.paths.level[:] = self._tracing.level
        self._marked, self._scaled = np.zeros(n, bool), np.zeros(n, bool)
        self._has_round = np.zeros(n_rounds, bool)
        self._watts = max(watts_of(sources), 1e-30)
        self._variance = np.full(len(self._receivers), np.inf)
        self._groups = Groups(sources, self._tracing.emission)
        self.touched, self.n_touched = np.zeros(self._groups.n, bool), 0
        self._scratch = no_paths(self._groups.n)
        self._map = PhotonMap(self._receivers, 2 * len(self._elements), self._watts / n)

    # --- edits --------------------------------------------------------------------------------------------------

    def edited(self, scene: Scene, tracer: TransparencyTracer) -> None:
        """The scene is otherwise: its lamps, its world, or an object of `moved`."""
        self._scene, self._tracer, self._edited = scene, tracer, True

    def _aim(self) -> None:
        """Photons set out as the edited scene's sources are; anew where these are others."""
        scene, tracer = self._scene, self._tracer
        sources = light_sources(scene, self._region)
        fits = not self._dark and bool(sources) and self._tracing.is_of(sources)
        if not fits or not 1 / _BRIGHTER < watts_of(sources) / self._watts < _BRIGHTER:
            return self._start(scene, tracer)
        self._edited, self._relit = False, True
        self.touched[:], self.n_touched, self._n_turns = False, 0, _N_TURNS
        self._tracing.aim(scene, tracer, sources)

    def moved(self, object_: int, boxes: np.ndarray) -> None:
        """An object has moved, around which boxes (b, 2, 3) lie where it was and is; `edited` comes after it."""
        if self._dark:
            return
        self._boxes.append(boxes)
        self._moved.add(object_)
        at, reach = self._receivers.position[:, None], self._map.largest_radius
        near = ((at > boxes[:, 0] - reach) & (at < boxes[:, 1] + reach)).all(axis=2).any(axis=1)
        self._map.unmeasure(np.flatnonzero(near))

    # --- steps --------------------------------------------------------------------------------------------------

    @property
    def finished(self) -> bool:
        """Whether all is known that will be."""
        if self._dark or self._edited:
            return not self._edited
        settled = not (self._boxes or self._relit or self._moved or self._queue or self._n_turns)
        return settled and bool(self._has_round.all()) and bool((self.paths.state == KEPT).all()) and self._measured

    @property
    def _measured(self) -> bool:
        return len(self._map.unmeasured(1)) == 0

    def jobs(self) -> list[Callable[[], Job]]:
        """The next step's; each is made when its turn comes."""
        if self._edited:
            self._aim()
        if self._dark:
            return []
        first = [self._mark, self._compare, self._take_out, self._place, self._enter, self._trace]
        if self._boxes or self._relit or self._moved:  # light that knows of an edit comes first
            return first
        return [*first, self._take_turns, self._trace_groups, self._measure]

    def _mark(self) -> Job:
        """Mark the photons whose paths cross what has moved."""
        if not self._boxes:
            return no_job()
        boxes = np.concatenate(self._boxes).astype(np.float32)
        mark = partial(mark_crossing, boxes)
        return self._of_all(lambda start, stop: mark(start, stop, self.paths, self._marked), self._boxes.clear)

    def _compare(self) -> Job:
        """Mark the photons that leave their sources otherwise."""
        if not self._relit:
            return no_job()
        arrays = self._tracing.emission.arrays

        def compare(start: int, stop: int) -> None:
            mark_emission(*arrays, start, stop, self.paths, self._marked, self._scaled)

        def done() -> None:
            self._relit = False

        return self._of_all(compare, done)

    def _take_out(self) -> Job:
        """Photons that are marked leave the map."""
        state = self.paths.state
        out, inside = self._marked | self._scaled, (state == KEPT) | (state == RENEWED)
        some = np.flatnonzero(out)
        if 2 * len(some) > np.count_nonzero(inside):  # it is quicker to put the others in again
            self._map.clear()
            state[inside] = WAITING
            self._leave(some)
            some = some[:0]

        def leave(chosen: np.ndarray) -> None:
            for which, renewed in ((KEPT, False), (RENEWED, True)):
                self._map.remove(self.paths, chosen[state[chosen] == which], renewed)
            self._leave(chosen)

        return of_blocks(some, _BLOCK, leave)

    def _leave(self, chosen: np.ndarray) -> None:
        """Chosen photons, which are out of the map, have another power or are to be traced again."""
        scaled = chosen[self._scaled[chosen] & ~self._marked[chosen]]
        scale_paths(*self._tracing.emission.arrays, scaled, self.paths)
        self.paths.state[scaled] = WAITING
        marked = chosen[self._marked[chosen]]
        self.paths.state[marked] = STALE
        self.touched[self._groups.of_photon[marked]] = True
        self.n_touched += len(marked)
        self._marked[chosen] = self._scaled[chosen] = False

    def _place(self) -> Job:
        """Receivers on objects that have moved take what photons bring to where they are now."""
        if not self._moved:
            return no_job()
        rows = np.flatnonzero(np.isin(self._objects, list(self._moved)))
        around, state = self._map.moved(rows), self.paths.state

        def add(start: int, stop: int) -> None:
            for which, renewed in ((KEPT, False), (RENEWED, True)):
                chosen = start + np.flatnonzero(state[start:stop] == which)
                self._map.add_to(around, self.paths, chosen, renewed)

        return self._of_all(add, self._moved.clear)

    def _enter(self) -> Job:
        """Photons that are known enter the map."""

        def enter(chosen: np.ndarray) -> None:
            self._map.add(self.paths, chosen)
            self.paths.state[chosen] = KEPT

        return of_blocks(np.flatnonzero(self.paths.state == WAITING), _BLOCK, enter)

    def _trace(self) -> Job:
        """Photons are traced again, those of the first rounds first; where none is to be, a few more rounds."""
        stale = np.flatnonzero(self.paths.state == STALE)
        if len(stale) == 0:
            return self._grow()
        of_round = self._tracing.round_of[stale]
        n_until = np.cumsum(np.bincount(of_round))
        last = int(np.searchsorted(n_until, _A_STEP))
        chosen = stale[of_round <= last]

        def renew(some: np.ndarray) -> None:
            self._tracing.trace(some, some, self.paths)
            self._map.add(self.paths, some, renewed=True)
            self.paths.state[some] = RENEWED

        def done() -> None:
            state = self.paths.state
            if not (state == STALE).any():
                self._map.merge()
                state[state == RENEWED] = KEPT

        return of_blocks(chosen, _BLOCK, renew, done)

    def _grow(self) -> Job:
        """More rounds."""
        rounds = np.flatnonzero(~self._has_round)[: _A_STEP // N_IN_ROUND]

        def trace(chunk: slice) -> None:
            for i in rounds[chunk]:
                some = self._tracing.of_round(int(i))
                self._tracing.trace(some, some, self.paths)
                self._map.add(self.paths, some)
                self.paths.state[some] = KEPT
                self._has_round[i] = True

        return Job(len(rounds), A_CHUNK, trace)

    def _take_turns(self) -> Job:
        """Trace one photon of each group again: where its path is another one, all of the group are to be."""
        if not self._n_turns:
            return no_job()
        chosen = self._groups.turn(self._turn)
        chosen = chosen[self.paths.state[chosen] == KEPT]
        differs = np.zeros(len(chosen), bool)

        def compare(rows: np.ndarray) -> None:
            self._tracing.trace(chosen[rows], rows, self._scratch)
            found = np.zeros(len(rows), bool)
            differing(self.paths, chosen[rows], self._scratch, rows, found)
            differs[rows] = found

        def done() -> None:
            self._turn, self._n_turns = self._turn + 1, self._n_turns - 1
            changed = np.unique([*self._queue, *self._groups.of_photon[chosen[differs]]]).astype(np.int64)
            energy = self._groups.energy(self.paths)[changed]
            self._queue = changed[np.argsort(-energy, kind="stable")].tolist()

        return of_blocks(np.arange(len(chosen)), _BLOCK, compare, done)

    def _trace_groups(self) -> Job:
        """Trace the photons again of those groups, of all that are to be, which bring most."""
        n_until = np.cumsum([len(self._groups.photons(group)) for group in self._queue])
        groups = self._queue[: int(np.searchsorted(n_until, _A_STEP)) + 1]

        def trace(chunk: slice) -> None:
            for group in groups[chunk]:
                some = self._groups.photons(group)
                some = some[self.paths.state[some] == KEPT]
                self._map.remove(self.paths, some)
                self._tracing.trace(some, some, self.paths)
                self._map.add(self.paths, some)
                self.touched[group] = True
                self._queue.remove(group)

        return Job(len(groups), A_CHUNK, trace)

    def _measure(self) -> Job:
        """Look for where surfaces end around receivers that are lit."""

        def measure(rows: np.ndarray) -> None:
            self._map.measure(rows, self._tracer.surfaces)

        return of_blocks(self._map.unmeasured(16 * _N_MEASURED), _N_MEASURED, measure)

    def _of_all(self, work: Callable[[int, int], None], done: Callable[[], object]) -> Job:
        """Work on all photons, from one to another of them."""
        n = self._tracing.n

        def blocks(chunk: slice) -> None:
            for k in range(chunk.start, chunk.stop):
                work(k * _LARGE_BLOCK, min((k + 1) * _LARGE_BLOCK, n))

        return Job(-(-n // _LARGE_BLOCK), A_CHUNK, blocks, done)

    # --- what is known ------------------------------------------------------------------------------------------

    def _shares(self) -> tuple[float, float]:
        """What the sum of photons in the map is to be multiplied by, and first what those traced again stand for."""
        n_rounds, state = int(np.count_nonzero(self._has_round)), self.paths.state
        renewed = int(np.count_nonzero(state == RENEWED))
        left = renewed + int(np.count_nonzero(state == STALE))
        return self._tracing.n_rounds / max(n_rounds, 1), left / max(renewed, 1)

    def light(self) -> np.ndarray:
        """E/π at the receivers, (n, 3) float32, W/(m² sr)."""
        if self._dark:
            return np.zeros((len(self._receivers), 3), np.float32)
        whole, renewed = self._shares()
        return (self._map.irradiance(renewed) * (whole / np.pi)).astype(np.float32)

    def variance(self) -> np.ndarray:
        """Of that, the mean over colours, (n,) float64; where photons are missing, by what it was with all of them."""
        if self._dark:
            return np.zeros(len(self._receivers))
        (whole, renewed), state = self._shares(), self.paths.state
        if (state[self._tracing.of_round(0)] == KEPT).all() and not (state == RENEWED).any():
            n_rounds = np.bincount(level_of_round(np.flatnonzero(self._has_round)), minlength=N_LEVELS)
            self._variance = self._map.variance(n_rounds) * (whole / np.pi) ** 2
        return self._variance * max(renewed, 1.0)

    def of_sides(self, coverage: np.ndarray) -> np.ndarray:
        """Mean of E/π over the sides of elements, (s, 3) float32, of which a share (s,) takes light."""
        if self._dark:
            return np.zeros((len(coverage), 3), np.float32)
        whole, renewed = self._shares()
        area = np.pi * np.repeat(self._elements.areas, 2) * np.maximum(coverage, 0.01)
        return (self._map.of_sides(renewed) * whole / area[:, None]).astype(np.float32)
