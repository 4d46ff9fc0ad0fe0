"""Bake Indirect: the button, and the same from a script."""

from pathlib import Path
from threading import Thread
from typing import Any

import bpy

from ..addon.errors import BakeError, Cancelled
from ..addon.inspector import Inspector
from ..addon.progress import Progress
from ..addon.settings import BakeSettings
from ..addon.ui.debug_views import debug_views
from ..addon.ui.redraw import redraw_view3d
from ..addon.ui.state import bake_state, duration
from .bake_job import BakeJob, Solved, Wanted
from .camera_target import WantedCamera
from .describe import describe
from .lightmap_target import WantedLightmaps
from .vertex_target import WantedVertices

TICK = 0.1
"""Seconds between two looks at the bake's thread."""


class Solver(Thread):
    """Solves a bake, off the main thread if it is started.

    It knows nothing of the operator, which Blender takes away when a file is opened or the extension is turned off.
    """

    def __init__(self, job: BakeJob, settings: BakeSettings, progress: Progress, inspector: Inspector) -> None:
        super().__init__(name="Photon Bake")
        self.job, self.progress = job, progress
        self._settings, self._inspector = settings, inspector
        self._solved: Solved | None = None
        self._error: Exception | None = None

    def run(self) -> None:
        try:
            self._solved = self.job.solve(self._settings, self.progress, self._inspector)
        except Exception as error:
            self._error = error

    def solved(self) -> Solved:
        """What came out; raises what went wrong."""
        if self._solved is None:
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


class PHOTON_BAKE_OT_bake_indirect(bpy.types.Operator):
    """Bake indirect light into a colour attribute"""

    bl_idname = "photon_bake.bake_indirect"
    bl_label = "Bake Indirect"
    bl_options = {"REGISTER", "UNDO"}
    _job: BakeJob | None = None

    __annotations__ = {
        "copies": bpy.props.BoolProperty(
            name="Bake Copies", description="As the panel's setting", default=False, options={"HIDDEN", "SKIP_SAVE"}
        )
    }

    @classmethod
    def poll(cls, context: Any) -> bool:
        if bake_state.running:
            cls.poll_message_set("A bake is running; wait for it or cancel it")
            return False
        return True

    def execute(self, context: Any) -> set[str]:
        """Bake to the end on the calling thread, for scripts."""
        try:
            self._prepare(context)
            self._solver.run()
            return self._finish()
        except Exception as error:
            return self._fail(error)
        finally:
            bake_state.progress = None  # Ctrl-C is no Exception

    def invoke(self, context: Any, event: Any) -> set[str]:
        """Bake in a thread of its own, so that the window stays awake."""
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
        if event.type == "ESC" and event.value == "PRESS":
            bake_state.cancel()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        redraw_view3d(context, "UI")
        if self._watch.alive:
            return {"PASS_THROUGH"}
        self._watch.end(context.window_manager)
        try:
            return self._finish()
        except Exception as error:
            return self._fail(error)

    def cancel(self, context: Any) -> None:
        """Blender ends the operator, because a file is opened or the window is closed."""
        self._watch.stop(context.window_manager)

    def _prepare(self, context: Any) -> None:
        properties = context.scene.photon_bake
        progress = bake_state.start(properties.gather, properties.targets)
        copies = self.copies or properties.bake_copies
        wanted, names = wanted_by(properties, copies), None
        if properties.selected_only and properties.targets != {"camera"}:  # a camera sees all objects
            names = selected_objects(context, copies)
        job = BakeJob.prepare(context, wanted, progress, names, properties.light_group, properties.strict)
        self._job = job
        job.check_strict()
        job.check_space()
        self._solver = Solver(job, properties.settings(), progress, debug_views.start())

    def _finish(self) -> set[str]:
        job, solved = self._job, self._solver.solved()
        assert job is not None  # as it was solved
        written = job.write(solved, self._solver.progress)
        irradiance = solved.irradiance
        result = f"{len(irradiance.value):,} points in {duration(bake_state.seconds)}"
        if irradiance.relative_noise > 0:
            result += f", noise {irradiance.relative_noise:.1%}"
        bake_state.stop(result=result, error=" ".join(written.failures), warnings=job.warnings)
        for warning in job.warnings:
            self.report({"WARNING"}, warning)
        self.report({"INFO"}, f"Baked {result}.")
        if written.failures:  # a script's call raises this; what was written stays, and can be undone
            self.report({"ERROR"}, f"{' '.join(written.failures)} The rest was written.")
        return {"FINISHED"}

    def _fail(self, error: Exception) -> set[str]:
        """End without light; a script's call raises the sentence."""
        if isinstance(error, Cancelled):
            bake_state.stop(result="Cancelled.")
            return {"CANCELLED"}
        sentence = describe(error)
        bake_state.stop(error=sentence, warnings=self._job.warnings if self._job else [])
        self.report({"ERROR"}, sentence)
        return {"CANCELLED"}


def wanted_by(properties: Any, copies: bool) -> list[Wanted]:
    """What the panel asks for; with copies of objects whose mesh cannot hold their light, or without."""
    wanted: list[Wanted] = []
    if "lightmap" in properties.targets:
        folder = _folder(properties.lightmap.folder, "the lightmaps have")
        scene = Path(bpy.data.filepath).stem or bpy.context.scene.name
        wanted.append(WantedLightmaps(properties.lightmap.settings(), folder, scene))
    if "camera" in properties.targets:
        folder = _folder(properties.camera.folder, "the camera's pass has")
        wanted.append(WantedCamera(properties.camera.settings(), folder))
    if "vertex" in properties.targets:
        wanted.append(WantedVertices(properties.attribute, copies, properties.fit, properties.denoise))
    if not wanted:
        raise BakeError("Nothing is chosen to bake to: choose Vertices, Lightmaps or Camera.")
    return wanted


def _folder(folder: str, what_has: str) -> Path:
    """A folder that the panel names, as a path."""
    if folder.startswith("//") and not bpy.data.filepath:
        raise BakeError(f"The file was never saved, so {what_has} no folder: save it, or choose a Folder.")
    return Path(bpy.path.abspath(folder))


def selected_objects(context: Any, copies: bool) -> list[str]:
    """Names of the selected mesh objects, and with copies of all others that may show meshes."""
    kinds = {"MESH", "CURVE", "SURFACE", "FONT", "META", "EMPTY"} if copies else {"MESH"}
    names = [thing.name for thing in context.selected_objects if thing.type in kinds]
    if not names:
        raise BakeError("No mesh object is selected: select some, or turn Selected Only off.")
    return names
