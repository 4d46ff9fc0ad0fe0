"""Bake Indirect: the button, and the same from a script."""

from pathlib import Path
from typing import Any

import bpy

from ..addon.blender.read.lamps.light_layers import group_names
from ..addon.core.errors import BakeError
from ..addon.pipeline.warm_up import compiler
from ..addon.ui.checks import checks, key_of
from ..addon.ui.outcomes import Outcome
from ..addon.ui.pace import learn
from ..addon.ui.staleness import follow, own_changes
from ..addon.ui.state import bake_state, duration
from ..addon.ui.views.debug_views import debug_views
from .baked_light import shown_after_bake
from .jobs.bake_job import BakeJob
from .jobs.describe import describe
from .jobs.folders import path_of, scene_name, without_folder
from .jobs.frame_bakes import FrameBakes, check_frames
from .jobs.solving import Solver, Solving
from .jobs.written import Written
from .targets.camera import CameraRequest
from .targets.lightmap import LightmapRequest
from .targets.probes import ProbeRequest
from .targets.recordings import VertexRecording, recording_of
from .targets.target import Request, Solved
from .targets.vertices import VertexRequest

_WHERE = {
    "vertex": "a color attribute of each mesh",
    "lightmap": "images",
    "camera": "a picture for compositing",
    "probes": "probes in the air",
}
"""What light of a target is baked to, for the tooltip."""


class PHOTON_BAKE_OT_bake_indirect(Solving, bpy.types.Operator):
    """Bake indirect light"""

    bl_idname = "photon_bake.bake_indirect"
    bl_label = "Bake Indirect"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = {
        "copies": bpy.props.BoolProperty(
            name="Bake Copies", description="As the panel's setting", default=False, options={"HIDDEN", "SKIP_SAVE"}
        )
    }

    _bakes: FrameBakes | None = None

    @classmethod
    def description(cls, context: Any, properties: Any) -> str:
        targets = context.scene.photon_bake.targets
        where = [words for target, words in _WHERE.items() if target in targets]
        return f"Bake indirect light into {' and '.join(where)}" if where else "Choose first what to bake to"

    def invoke(self, context: Any, event: Any) -> set[str]:
        """Bake in a thread of its own, after asking for a folder where files have none."""
        if not bpy.app.background and without_folder(context.scene.photon_bake):
            bpy.ops.photon_bake.choose_folder("INVOKE_DEFAULT", copies=self.copies)
            return {"CANCELLED"}
        return super().invoke(context, event)

    def _prepare(self, context: Any) -> None:
        self._scene, properties = context.scene.name, context.scene.photon_bake
        self._bakes, self._files = bakes_of(context.scene, self._with_copies(properties)), list[Path]()
        n_times = len(self._bakes.frames) if self._bakes else 1
        targets, uid = properties.targets, context.scene.session_uid
        self._progress = bake_state.start(properties.gather, targets, uid, n_times)
        self._gather, self._foretold = properties.gather, _foretold(context)
        self._asked, self._compiled = key_of(context.scene), compiler.seconds
        self._next = 0
        self._prepare_next(context)

    def _with_copies(self, properties: Any) -> bool:
        return self.copies or properties.bake_copies

    def _prepare_next(self, context: Any) -> None:
        """Read the current frame, or of several the next one."""
        properties, copies = context.scene.photon_bake, self._with_copies(context.scene.photon_bake)
        if self._bakes:
            self._time = self._bakes.frames.times[self._next]
            self._bakes.go_to(self._time)
            requests = self._bakes.requests(self._time)
        else:
            requests = requests_of(properties, copies)
        names, warnings = None, self._job.warnings if self._job and self._next else []
        if properties.selected_only and properties.targets != {"camera"}:  # a camera sees all objects
            names = selected_objects(context, copies)
        group, apart = properties.light_group, properties.light_groups == "apart"
        steps = properties.motion_blur
        job = BakeJob.prepare(context, requests, self._progress, names, group, properties.strict, apart, steps)
        job.warnings = list(dict.fromkeys([*warnings, *job.warnings]))
        self._job = job
        job.check_strict()
        if self._next == 0:
            job.check_space(len(self._bakes.frames) if self._bakes else 1)
        before = self._bakes.before if self._bakes else None
        self._solver = Solver(job, properties.settings(), self._progress, debug_views.start(), before)
        self._next += 1

    def _goes_on(self, context: Any) -> bool:
        """See `Solving._goes_on`: takes the light of a frame that others follow."""
        if self._bakes is None or self._next == len(self._bakes.frames):
            return False
        self._take(self._solver.solved())
        bake_state.next_time()
        self._prepare_next(context)
        return True

    def _take(self, solved: Solved) -> Written:
        """Write what there is of a frame."""
        assert self._bakes is not None and self._job is not None
        with own_changes():
            written = self._bakes.take(self._time, self._job, solved, self._progress)
        self._files += written.files
        return written

    def _write(self, solved: Solved) -> Written:
        """Write the light, or of several frames the last one's, and what plays them back."""
        assert self._job is not None  # as it was solved
        if self._bakes is None:
            return self._job.write(solved, self._progress)
        written = self._take(solved)
        self._bakes.go_back()
        written.add(self._bakes.finish())
        written.files = self._files + [path for path in written.files if path not in self._files]
        return written

    def _fail(self, error: Exception) -> set[str]:
        if self._bakes is not None:
            self._bakes.go_back()
        return super()._fail(error)

    def _finish(self) -> set[str]:
        solved, job = self._solver.solved(), self._job
        assert job is not None
        with own_changes():
            written = self._write(solved)
            scene = bpy.data.scenes.get(self._scene)
            if scene is not None:
                job.warnings += shown_after_bake(scene, scene.photon_bake.shown.after_bake)
        outcome = _outcome(job, solved, written)
        outcome.asked = self._asked
        bake_state.stop(outcome)
        if scene is not None:
            follow(scene)
        if self._bakes is None:
            learn(self._gather, self._foretold, bake_state.seconds - (compiler.seconds - self._compiled))
        if bpy.app.background:  # in a window the panel says them
            for warning in job.warnings:
                self.report({"WARNING"}, warning)
        self.report({"INFO"}, f"Baked {outcome.result}.")
        if written.failures:  # a script's call raises this; what was written stays, and can be undone
            self.report({"ERROR"}, f"{' '.join(written.failures)} The rest was written.")
        return {"FINISHED"}


def bakes_of(scene: Any, copies: bool) -> FrameBakes | None:
    """The bakes of the scene's frames; None where the current one alone is baked."""
    properties = scene.photon_bake
    frames = properties.frames.of_scene(scene)
    if frames is None:
        return None
    check_frames(frames, properties.targets, copies)

    def of_vertices(request: VertexRequest) -> VertexRecording:
        keeping, folder = properties.frames.keeping, Path()
        if keeping == "texture":
            folder = path_of(properties.frames.folder, "the light of vertices has")
        return VertexRecording(request, frames, keeping, folder, scene_name(scene))

    return FrameBakes(frames, [recording_of(one, frames, of_vertices) for one in requests_of(properties, copies)])


def _foretold(context: Any) -> float:
    """Seconds that the bake is expected to take; 0 where a fault of the check's should not stop it."""
    try:
        return checks.make(context.scene, context.view_layer).estimate.seconds
    except Exception as error:
        describe(error)
        return 0.0


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


def requests_of(properties: Any, copies: bool) -> list[Request]:
    """What the panel asks for; with copies of objects whose mesh cannot hold their light, or without."""
    requests: list[Request] = []
    groups, scene = _groups(properties), scene_name(bpy.context.scene)
    if "lightmap" in properties.targets:
        folder = path_of(properties.lightmap.folder, "the lightmaps have")
        requests.append(LightmapRequest(properties.lightmap.settings(), folder, scene, None, groups, copies))
    if "camera" in properties.targets:
        folder = path_of(properties.camera.folder, "the camera's pass has")
        requests.append(CameraRequest(properties.camera.settings(), folder, groups))
    if "probes" in properties.targets:
        folder = path_of(properties.probes.folder, "the probes have")
        requests.append(ProbeRequest(properties.probes.settings(), folder, scene))
    if "vertex" in properties.targets:
        on_vertices = properties.fit, properties.denoise
        requests.append(VertexRequest(properties.attribute, copies, groups, *on_vertices))
    if not requests:
        raise BakeError("Nothing is chosen to bake to: choose Vertices, Lightmaps, Camera or Probes.")
    return requests


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
