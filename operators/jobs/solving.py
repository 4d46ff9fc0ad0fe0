"""Operators around a bake: those that wait for its end, and those that solve one, in a window on its own thread."""

from threading import Thread
from typing import Any

import bpy

from ...addon.core.errors import Cancelled
from ...addon.core.inspector import Inspector
from ...addon.core.progress import Progress
from ...addon.settings.bake import BakeSettings
from ...addon.ui.outcomes import Outcome
from ...addon.ui.redraw import redraw_panels
from ...addon.ui.state import bake_state
from ...addon.ui.status_bar import hide_progress, show_progress
from ..targets.target import Solved
from .bake_job import BakeJob
from .describe import describe

TICK = 0.1
"""Seconds between two looks at the bake's thread."""


class Solver(Thread):
    """Solves a bake, off the main thread if it is started.

    It knows nothing of the operator, which Blender takes away when a file is opened or the extension is turned off.
    """

    def __init__(
        self,
        job: BakeJob,
        settings: BakeSettings,
        progress: Progress,
        inspector: Inspector,
        before: Solved | None = None,
    ) -> None:
        super().__init__(name="Photon Bake")
        self.job, self.progress = job, progress
        self._settings, self._inspector, self._before = settings, inspector, before
        self._solved: Solved | None = None
        self._error: Exception | None = None

    def run(self) -> None:
        try:
            self._solved = self.job.solve(self._settings, self.progress, self._inspector, self._before)
        except Exception as error:
            self._error = error

    def solved(self) -> Solved:
        """What came out; raises what went wrong."""
        if self._solved is None or self.progress.cancelled:
            raise self._error or Cancelled
        return self._solved


class Watch:
    """A bake's thread, and the timer by which a window looks at it: Blender takes neither away with the operator."""

    def __init__(self, solver: Solver, context: Any) -> None:
        self._solver = solver
        self._timer = context.window_manager.event_timer_add(TICK, window=context.window)
        _watches.append(self)
        solver.start()

    @property
    def alive(self) -> bool:
        """Whether the thread runs."""
        return self._solver.is_alive()

    def end(self, window_manager: Any) -> None:
        """Look no longer."""
        if self in _watches:
            _watches.remove(self)
            window_manager.event_timer_remove(self._timer)

    def stop(self, window_manager: Any) -> None:
        """Cancel the bake, and wait for its thread to end."""
        self._solver.progress.cancel()
        self._solver.join()
        self.end(window_manager)
        bake_state.stop()


_watches: list[Watch] = []
"""The bake that runs in a window, if one does."""


def stop_watched() -> None:
    """Stop the bake that runs in a window, if one does: for `unregister`, which ends operators without a word."""
    for watch in list(_watches):
        watch.stop(bpy.context.window_manager)


class NotWhileBaking:
    """An operator that waits for a bake to end."""

    @classmethod
    def poll(cls, context: Any) -> bool:
        lacking = "A bake is running; wait for it or cancel it" if bake_state.running else cls._lacking(context)
        if lacking:
            cls.poll_message_set(lacking)  # type: ignore[attr-defined]
        return not lacking

    @classmethod
    def _lacking(cls, context: Any) -> str:
        """A sentence on what else there has to be; empty where it is there."""
        return ""


class Solving(NotWhileBaking):
    """An operator that solves a bake and writes it: to the end for scripts, in a thread of its own in a window."""

    _job: BakeJob | None = None
    _solver: Solver

    def _prepare(self, context: Any) -> None:
        """Read what the bake needs: sets the job and its solver."""
        raise NotImplementedError

    def _finish(self) -> set[str]:
        """Write what was solved; raises what went wrong."""
        raise NotImplementedError

    def _goes_on(self, context: Any) -> bool:
        """Whether another bake follows that which was solved, which is prepared then; raises what went wrong."""
        return False

    def execute(self, context: Any) -> set[str]:
        """Solve and write to the end on the calling thread, for scripts."""
        try:
            self._prepare(context)
            self._solver.run()
            while self._goes_on(context):
                self._solver.run()
            return self._finish()
        except Exception as error:
            return self._fail(error)
        finally:
            bake_state.progress = None  # Ctrl-C is no Exception

    def invoke(self, context: Any, event: Any) -> set[str]:
        """Solve in a thread of its own, so that the window stays awake."""
        if bpy.app.background:
            return self.execute(context)
        try:
            self._prepare(context)
        except Exception as error:
            return self._fail(error)
        self._watch = Watch(self._solver, context)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Any, event: Any) -> set[str]:
        """Show the progress, hear Esc, and write the light when the thread is done."""
        if event.type == "ESC" and event.value == "PRESS" and over_view(context, event):
            bake_state.cancel()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        redraw_panels(context)
        show_progress(context)
        if self._watch.alive and not self._solver.progress.cancelled:  # its thread ends by itself, and leaves nothing
            return {"PASS_THROUGH"}
        self._watch.end(context.window_manager)
        try:
            if self._goes_on(context):
                self._watch = Watch(self._solver, context)
                return {"RUNNING_MODAL"}
            hide_progress(context)
            return self._finish()
        except Exception as error:
            hide_progress(context)
            return self._fail(error)

    def cancel(self, context: Any) -> None:
        """Blender ends the operator, because a file is opened or the window is closed."""
        self._watch.stop(context.window_manager)
        hide_progress(context)

    def _fail(self, error: Exception) -> set[str]:
        """End without light; a script's call raises the sentence."""
        if isinstance(error, Cancelled):
            bake_state.stop(Outcome(result="Cancelled."))
            return {"CANCELLED"}
        sentence = describe(error)
        bake_state.stop(Outcome(error=sentence, warnings=self._job.warnings if self._job else []))
        self.report({"ERROR"}, sentence)  # type: ignore[attr-defined]
        return {"CANCELLED"}


def over_view(context: Any, event: Any) -> bool:
    """Whether the pointer is over a 3D view: elsewhere Esc means something else."""
    return any(
        area.type == "VIEW_3D"
        and 0 <= event.mouse_x - area.x < area.width
        and 0 <= event.mouse_y - area.y < area.height
        for area in context.screen.areas
    )
