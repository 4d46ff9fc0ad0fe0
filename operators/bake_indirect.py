"""Bake Indirect: the button, and the same from a script."""

from pathlib import Path
from threading import Thread
from typing import Any

import bpy

from ..addon.blender.light_layers import group_names
from ..addon.errors import BakeError, Cancelled
from ..addon.inspector import Inspector
from ..addon.progress import Progress
from ..addon.settings import BakeSettings
from ..addon.ui.checks import checks, key_of
from ..addon.ui.debug_views import debug_views
from ..addon.ui.outcomes import Outcome
from ..addon.ui.pace import learn
from ..addon.ui.redraw import redraw_panels
from ..addon.ui.staleness import follow, own_changes
from ..addon.ui.state import bake_state, duration
from ..addon.ui.status_bar import hide_progress, show_progress
from .bake_job import BakeJob
from .baked_light import shown_after_bake
from .camera_target import WantedCamera
from .describe import describe
from .folders import path_of, without_folder
from .lightmap_target import WantedLightmaps
from .probe_target import WantedProbes
from .target import Solved, Wanted
from .vertex_target import WantedVertices
from .written import Written

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


_WHERE = {
    "vertex": "a color attribute of each mesh",
    "lightmap": "images",
    "camera": "a picture for compositing",
    "probes": "probes in the air",
}
"""What light of a target is baked to, for the tooltip."""


class PHOTON_BAKE_OT_bake_indirect(bpy.types.Operator):
    """Bake indirect light"""

    bl_idname = "photon_bake.bake_indirect"
    bl_label = "Bake Indirect"
    bl_options = {"REGISTER", "UNDO"}
    _job: BakeJob | None = None
    _writes_files = True

    __annotations__ = {
        "copies": bpy.props.BoolProperty(
            name="Bake Copies", description="As the panel's setting", default=False, options={"HIDDEN", "SKIP_SAVE"}
        )
    }

    @classmethod
    def description(cls, context: Any, properties: Any) -> str:
        targets = context.scene.photon_bake.targets
        where = [words for target, words in _WHERE.items() if target in targets]
        return f"Bake indirect light into {' and '.join(where)}" if where else "Choose first what to bake to"

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
        if self._writes_files and without_folder(context.scene.photon_bake):
            bpy.ops.photon_bake.choose_folder("INVOKE_DEFAULT", copies=self.copies)
            return {"CANCELLED"}
        try:
            self._prepare(context)
        except Exception as error:
            return self._fail(error)
        self._watch = Watch(self._solver, context)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Any, event: Any) -> set[str]:
        """Show the progress, hear Esc, and write the light when the thread is done."""
        if event.type == "ESC" and event.value == "PRESS" and _over_view(context, event):
            bake_state.cancel()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        redraw_panels(context)
        show_progress(context)
        if self._watch.alive and not self._solver.progress.cancelled:  # its thread ends by itself, and leaves nothing
            return {"PASS_THROUGH"}
        self._watch.end(context.window_manager)
        hide_progress(context)
        try:
            return self._finish()
        except Exception as error:
            return self._fail(error)

    def cancel(self, context: Any) -> None:
        """Blender ends the operator, because a file is opened or the window is closed."""
        self._watch.stop(context.window_manager)
        hide_progress(context)

    def _prepare(self, context: Any) -> None:
        self._scene, properties = context.scene.name, context.scene.photon_bake
        progress = bake_state.start(properties.gather, properties.targets, context.scene.session_uid)
        self._gather, self._foretold = properties.gather, _foretold(context)
        self._asked = key_of(context.scene)
        copies = self.copies or properties.bake_copies
        wanted, names = wanted_by(properties, copies), None
        if properties.selected_only and properties.targets != {"camera"}:  # a camera sees all objects
            names = selected_objects(context, copies)
        group, apart = properties.light_group, properties.light_groups == "apart"
        job = BakeJob.prepare(context, wanted, progress, names, group, properties.strict, apart)
        self._job = job
        job.check_strict()
        job.check_space()
        self._solver = Solver(job, properties.settings(), progress, debug_views.start())

    def _finish(self) -> set[str]:
        job, solved = self._job, self._solver.solved()
        assert job is not None  # as it was solved
        with own_changes():
            written = job.write(solved, self._solver.progress)
            scene = bpy.data.scenes.get(self._scene)
            if scene is not None:
                job.warnings += shown_after_bake(scene, scene.photon_bake.shown.after_bake)
        outcome = _outcome(job, solved, written)
        outcome.asked = self._asked
        bake_state.stop(outcome)
        follow(bpy.context.scene)
        learn(self._gather, self._foretold, bake_state.seconds)
        if bpy.app.background:  # in a window the panel says them
            for warning in job.warnings:
                self.report({"WARNING"}, warning)
        self.report({"INFO"}, f"Baked {outcome.result}.")
        if written.failures:  # a script's call raises this; what was written stays, and can be undone
            self.report({"ERROR"}, f"{' '.join(written.failures)} The rest was written.")
        return {"FINISHED"}

    def _fail(self, error: Exception) -> set[str]:
        """End without light; a script's call raises the sentence."""
        if isinstance(error, Cancelled):
            bake_state.stop(Outcome(result="Cancelled."))
            return {"CANCELLED"}
        sentence = describe(error)
        bake_state.stop(Outcome(error=sentence, warnings=self._job.warnings if self._job else []))
        self.report({"ERROR"}, sentence)
        return {"CANCELLED"}


def _foretold(context: Any) -> float:
    """Seconds that the bake is expected to take; 0 where a fault of the check's should not stop it."""
    try:
        return checks.make(context.scene, context.view_layer).estimate.seconds
    except Exception as error:
        describe(error)
        return 0.0


def _over_view(context: Any, event: Any) -> bool:
    """Whether the pointer is over a 3D view: elsewhere Esc means something else."""
    return any(
        area.type == "VIEW_3D"
        and 0 <= event.mouse_x - area.x < area.width
        and 0 <= event.mouse_y - area.y < area.height
        for area in context.screen.areas
    )


def _outcome(job: BakeJob, solved: Solved, written: Written) -> Outcome:
    """What the panel says of a bake that was written."""
    light = solved.irradiance.value
    result = f"{solved.n_points:,} points in {duration(bake_state.seconds)}"
    if solved.relative_noise > 0:
        result += f", noise {solved.relative_noise:.1%}"
    return Outcome(
        result=result,
        error=" ".join(written.failures),
        warnings=job.warnings,
        places=written.places,
        files=written.files,
        noise=solved.relative_noise,
        black=bool(len(light)) and not light.any(),
    )


def wanted_by(properties: Any, copies: bool) -> list[Wanted]:
    """What the panel asks for; with copies of objects whose mesh cannot hold their light, or without."""
    wanted: list[Wanted] = []
    groups = _groups(properties)
    if "lightmap" in properties.targets:
        folder = path_of(properties.lightmap.folder, "the lightmaps have")
        scene = Path(bpy.data.filepath).stem or bpy.context.scene.name
        wanted.append(WantedLightmaps(properties.lightmap.settings(), folder, scene, None, groups, copies))
    if "camera" in properties.targets:
        folder = path_of(properties.camera.folder, "the camera's pass has")
        wanted.append(WantedCamera(properties.camera.settings(), folder, groups))
    if "probes" in properties.targets:
        folder = path_of(properties.probes.folder, "the probes have")
        scene = Path(bpy.data.filepath).stem or bpy.context.scene.name
        wanted.append(WantedProbes(properties.probes.settings(), folder, scene))
    if "vertex" in properties.targets:
        on_vertices = properties.fit, properties.denoise
        wanted.append(WantedVertices(properties.attribute, copies, groups, *on_vertices))
    if not wanted:
        raise BakeError("Nothing is chosen to bake to: choose Vertices, Lightmaps, Camera or Probes.")
    return wanted


def _groups(properties: Any) -> tuple[str, ...]:
    """The light groups that are baked apart; none where they are not."""
    if properties.light_groups == "one" and not properties.light_group:
        raise BakeError("No light group is chosen to bake alone: choose a Light Group, or bake All Together.")
    if properties.light_groups != "apart":
        return ()
    return group_names(bpy.context.view_layer, properties.attribute if "vertex" in properties.targets else "")


def selected_objects(context: Any, copies: bool) -> list[str]:
    """Names of the selected mesh objects, and with copies of all others that may show meshes."""
    kinds = {"MESH", "CURVE", "SURFACE", "FONT", "META", "EMPTY"} if copies else {"MESH"}
    names = [thing.name for thing in context.selected_objects if thing.type in kinds]
    if not names:
        raise BakeError("No mesh object is selected: select some, or turn Selected Only off.")
    return names
