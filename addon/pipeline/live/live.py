"""Live light on a thread of its own."""

from threading import Condition, Thread
from time import perf_counter

from ...core.errors import BakeError, Cancelled
from ...scene import Scene
from ...settings.live import LiveSettings
from .crew import Crew, Halt
from .edits import Edit, coalesced
from .light import LiveLight
from .solver import Solver
from .surfaces import LiveSurfaces


class Live:
    """Keeps the light at the vertices of a scene's surfaces up to date; safe to call from any thread.

    A thread works until the light has converged, and sleeps then. An edit halts what it does within 50 ms, unless that
    is the first light after an edit, which comes first: who drags a lamp shall see light on the way.
    Either call `start`, or `step` until it says that nothing is left.

    Parameters
    ----------
    scene : Scene
    surfaces : LiveSurfaces
        Of the same scene, by `live_surfaces`.
    settings : LiveSettings
    """

    def __init__(self, scene: Scene, surfaces: LiveSurfaces, settings: LiveSettings | None = None) -> None:
        settings = settings or LiveSettings()
        self._first: tuple[Scene, LiveSurfaces, LiveSettings] | None = (scene, surfaces, settings)
        self._edits: list[Edit] = []
        self._came = self._since = perf_counter()
        self._changed, self._halt, self._stopping = Condition(), Halt(), False
        self._crew = Crew(settings.n_threads, settings.seed, self._halt)
        self._solver: Solver | None = None
        self._light: LiveLight | None = None
        self._failure: Exception | None = None
        self._thread: Thread | None = None
        self._responding = True

    def start(self) -> None:
        """Begin to work on a thread; that it runs already is fine."""
        if self._thread is None:
            self._stopping = False
            self._thread = Thread(target=self._run, name="Photon Bake (live)", daemon=True)
            self._thread.start()

    def stop(self) -> None:
        """End the thread, which takes 50 ms at most unless trees are being built; light stays as it is."""
        thread, self._thread = self._thread, None
        with self._changed:
            self._stopping = self._halt.asked = True
            self._changed.notify_all()
        if thread is not None:
            thread.join()
        self._halt.asked = False

    def edit(self, *edits: Edit) -> None:
        """Say what has changed; returns at once."""
        with self._changed:
            self._edits = coalesced([*self._edits, *edits])
            self._came = perf_counter()
            self._halt.asked = self._halt.asked or not self._responding
            self._changed.notify_all()

    @property
    def light(self) -> LiveLight | None:
        """The newest light; None before there is any."""
        return self._light

    @property
    def failure(self) -> Exception | None:
        """What the thread has ended with: of a `BakeError` the message is for people. None while all is well."""
        return self._failure

    def step(self) -> bool:
        """Take in what edits there are, do the next step of the work and say whether more is left."""
        with self._changed:
            edits, self._edits = self._edits, []
            since = self._came if edits or self._solver is None else self._since
            self._responding = self._responding or bool(edits)
            self._halt.asked = self._stopping
        solver = self._taken_in(edits)
        self._since = since
        solver.step()
        version = self._light.version + 1 if self._light else 1
        self._light = light = solver.light(version, since)
        self._responding = False
        return not light.converged

    def _taken_in(self, edits: list[Edit]) -> Solver:
        """What finds the light, after it took in edits; those that a halt kept it from come again."""
        try:
            if self._solver is None:
                assert self._first is not None
                self._solver, self._first = Solver(*self._first, self._crew), None
            if edits:
                self._solver.apply(edits)
        except Cancelled:
            with self._changed:
                self._edits = coalesced([*edits, *self._edits])
            raise
        return self._solver

    def _run(self) -> None:
        more = True
        while self._woken(more):
            try:
                more = self.step()
            except Cancelled:
                more = True
            except Exception as error:
                self._failure = error if isinstance(error, BakeError) else RuntimeError(f"Live light: {error!r}")
                self._failure.__cause__ = error
                return

    def _woken(self, more: bool) -> bool:
        """Wait for something to do, of which there may be more; whether there is, and not the end."""
        with self._changed:
            self._changed.wait_for(lambda: more or bool(self._edits) or self._stopping)
            return not self._stopping
