"""The switch of live light. Its state is this Blender's alone: nothing of it is in files, and undo leaves it."""

import gc
import traceback
from time import perf_counter
from typing import Any

import bpy

from ..blender.viewport.session import LiveSession
from ..core.errors import BakeError
from ..pipeline.warm_up import COMPILING, compiler
from .redraw import redraw_panels, redraw_view3d
from .state import bake_state, duration

_AWAKE, _ASLEEP = 1 / 60, 0.1
"""Seconds between two looks at changes and light, while there are any and while light stays as it is."""

_PANEL = 0.3
"""Seconds between two redraws of the panels."""

NO_WINDOW = "Live light is drawn in 3D views, and this Blender has no window: open the file in one that has."

MODES = (
    ("colored", "Light & Color", "Surfaces in their base color times the light on them, with emission and sky"),
    ("indirect", "Indirect Only", "The light that surfaces reflect to each other, without colors, as it is baked"),
    ("light", "Light Only", "Direct and indirect light on surfaces, without their colors"),
)


class LiveSwitch:
    """Turns live light on and off, and keeps it going meanwhile.

    Attributes
    ----------
    session : LiveSession or None
    mode : str
        Which of `MODES` is shown.
    error : str
        Why it was not turned on, or what turned it off; empty where nothing went wrong.
    """

    def __init__(self) -> None:
        self.session: LiveSession | None = None
        self.mode = MODES[0][0]
        self.error = ""
        self._on = False
        self._rendering = self._paused = False
        self._failure: Exception | None = None
        self._said, self._said_at = "", 0.0  # by the panels, and when they were drawn

    @property
    def on(self) -> bool:
        """Whether it is turned on; without a session it waits for kernels to be compiled."""
        return self._on

    def turn_on(self, scene: Any, view_layer: Any) -> None:
        """Turn it on for a view layer of a scene.

        Raises
        ------
        BakeError
            If it cannot be; it stays off.
        """
        self.turn_off()
        if bpy.app.background:
            raise BakeError(NO_WINDOW)
        self._on = True
        for handlers, function in _handlers():
            handlers.append(function)
        try:
            if not compiler.running:
                self._start(scene, view_layer)
        except Exception:
            self.turn_off()
            raise
        bpy.app.timers.register(_tick, persistent=True)

    def turn_off(self, error: str = "") -> None:
        """Turn it off; nothing of it is left."""
        self.error = error
        if not self._on:
            return
        self._on = False
        if self.session is not None:
            self.session.end()
        self.session = self._failure = None
        gc.collect()  # hundreds of megabytes, some of them in cycles
        for handlers, function in _handlers():
            if function in handlers:
                handlers.remove(function)
        if bpy.app.timers.is_registered(_tick):
            bpy.app.timers.unregister(_tick)
        redraw_view3d(bpy.context, "WINDOW")
        redraw_panels(bpy.context)

    def _start(self, scene: Any, view_layer: Any) -> None:
        self._paused = False
        self.session = LiveSession(scene, view_layer, scene.photon_bake.live.settings(), lambda: self.mode, self._fails)

    def _fails(self, error: Exception) -> None:
        self._failure = error

    def tick(self) -> float:
        """Follow the scene; returns seconds until the next look."""
        try:
            if self._failure is not None:
                raise self._failure
            if self.session is None:
                if not compiler.running:
                    window = bpy.context.window_manager.windows[0]
                    self._start(window.scene, window.view_layer)
                return _ASLEEP
            return self._follow(self.session)
        except Exception as error:
            self.turn_off(sentence_of(error))
            return 0.0

    def _follow(self, session: LiveSession) -> float:
        paused = self._rendering or bake_state.running or bpy.app.is_job_running("RENDER")
        if paused != self._paused:
            session.pause(paused)
            self._paused = paused
            redraw_panels(bpy.context)
        if paused:
            return _ASLEEP
        light = session.light
        if session.tick():
            redraw_view3d(bpy.context, "WINDOW")
        if self.words != self._said and perf_counter() > self._said_at + _PANEL:
            self._said, self._said_at = self.words, perf_counter()
            redraw_panels(bpy.context)
        settled = light is not None and light.converged and session.light is light and session.behind is None
        return _ASLEEP if settled and not session.changes else _AWAKE

    def wake(self) -> None:
        """Look soon, since there is something new."""
        if self._on and bpy.app.timers.is_registered(_tick):
            bpy.app.timers.unregister(_tick)
            bpy.app.timers.register(_tick, persistent=True)

    def renders(self, on: bool) -> None:
        """A render begins or has ended."""
        self._rendering = on

    @property
    def words(self) -> str:
        """How far light has converged, and how old it is."""
        session = self.session
        if session is None:
            return COMPILING
        if self._paused:
            return "Paused while Blender renders or bakes"
        light = session.light
        if light is None:
            return "Finding the first light"
        known = f"within {light.error:.1%}" if light.error < 1 else "not known yet"
        done = ", converged" if light.converged else ""
        behind = f"; {duration(session.behind)} behind" if session.behind is not None else ""
        return f"Indirect light {known}{done}{behind}"


live_switch = LiveSwitch()
"""One scene is live at a time in a Blender, so there is one."""


def sentence_of(error: Exception) -> str:
    """One sentence about an error; of one that is no fault of the input, the console has all."""
    if isinstance(error, BakeError):
        return str(error)
    traceback.print_exception(error)
    return f"Live light ended unexpectedly ({type(error).__name__}: {error}); the console has the details."


def _tick() -> float | None:
    seconds = live_switch.tick()
    return seconds if live_switch.on else None


@bpy.app.handlers.persistent
def _on_update(scene: Any, depsgraph: Any) -> None:
    if live_switch.session is not None and depsgraph is not None:
        live_switch.session.note(scene, depsgraph)
        live_switch.wake()


@bpy.app.handlers.persistent
def _on_undo(*_: Any) -> None:
    if live_switch.session is not None:
        live_switch.session.forget()


@bpy.app.handlers.persistent
def _on_render(*_: Any) -> None:
    live_switch.renders(True)


@bpy.app.handlers.persistent
def _on_render_end(*_: Any) -> None:
    live_switch.renders(False)


@bpy.app.handlers.persistent
def _before_load(*_: Any) -> None:
    """What was live goes with its file; the switch stays on for the next one."""
    if live_switch.session is not None:
        live_switch.session.end()
        live_switch.session = None
        gc.collect()


def _handlers() -> list[tuple[list[Any], Any]]:
    """What is called while live light is on."""
    known = bpy.app.handlers
    return [
        (known.depsgraph_update_post, _on_update),
        (known.frame_change_post, _on_update),
        (known.undo_post, _on_undo),
        (known.redo_post, _on_undo),
        (known.render_init, _on_render),
        (known.render_complete, _on_render_end),
        (known.render_cancel, _on_render_end),
        (known.load_pre, _before_load),
    ]


def _mode(_: Any) -> int:
    return [name for name, _, _ in MODES].index(live_switch.mode)


def _set_mode(_: Any, number: int) -> None:
    live_switch.mode = MODES[number][0]
    redraw_view3d(bpy.context, "WINDOW")


def register() -> None:
    """Give the window manager what is shown."""
    bpy.types.WindowManager.photon_bake_live_mode = bpy.props.EnumProperty(
        name="Live Shows",
        description="What 3D views show of live light",
        items=MODES,
        get=_mode,
        set=_set_mode,
        options={"SKIP_SAVE"},
    )


def unregister() -> None:
    """Turn live light off, and take that away."""
    live_switch.turn_off()
    del bpy.types.WindowManager.photon_bake_live_mode
