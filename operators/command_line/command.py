"""The command: ``blender -b scene.blend -c photon_bake [options]``."""

import atexit
import re
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from time import perf_counter
from typing import Any

import bpy

from ...addon.blender.read.lamps.light_layers import group_names
from ...addon.core.errors import BakeError, Cancelled
from ...addon.core.progress import Progress
from ...addon.output import Report, atomic_path, check_writable, hushed, peak_memory_mb
from ...addon.pipeline.refinement import RefineOptions
from ...addon.pipeline.warm_up import compiler
from ...addon.settings.frames import Frames
from ...addon.ui.state import duration, shares_of
from ..baked_light import shown_after_bake
from ..jobs.bake_job import BakeJob
from ..jobs.describe import describe
from ..jobs.folders import scene_name
from ..jobs.frame_bakes import FrameBakes
from ..jobs.versions import versions
from ..refine import draft_of
from ..targets.camera import CameraRequest
from ..targets.lightmap import LightmapRequest
from ..targets.probes import ProbeRequest
from ..targets.recordings import VertexRecording, recording_of
from ..targets.refine import RefineRequest
from ..targets.target import Request
from ..targets.vertices import VertexRequest
from .console import ProgressLine, ctrl_c_cancels, say
from .options import COMMAND, Options, parse

DONE, FAILED, CANCELLED = 0, 1, 130
SAVING = "Saving"


def run(arguments: list[str]) -> int:
    """Bake as the arguments say.

    Returns
    -------
    int
        The exit status: 0 done, 1 failed, 2 bad usage, 130 cancelled.
    """
    unopened = "" if bpy.data.filepath else named_file(sys.argv)
    try:
        options = parse(arguments, bpy.data.filepath or unopened)
    except SystemExit as end:
        return int(end.code or 0)
    shares = shares_of(options.settings.gather, [*options.targets, *(["refine"] if options.refine else [])])
    line = ProgressLine(sys.stderr, shares, len(options.frames or [0]))
    progress = Progress(line)
    report = _begin(options)
    started, compiled, baked = perf_counter(), compiler.seconds, False
    try:
        with ctrl_c_cancels(progress):
            if unopened:  # Blender goes on with a scene of its own
                raise BakeError(_why_unopened(unopened))
            failures = _bake(options, progress, report, line.next_time)
        status = FAILED if failures else DONE
        report.message, baked = " ".join(failures), True
    except Cancelled:
        report.status, report.message, status = "cancelled", "Cancelled; nothing was changed.", CANCELLED
    except Exception as error:
        report.status, report.message, status = "failed", describe(error), FAILED
    line.clear()
    report.total_seconds, report.compile_seconds = perf_counter() - started, compiler.seconds - compiled
    return _end(report, progress, options, status, baked)


def named_file(arguments: list[str]) -> str:
    """The last .blend file before the command in Blender's own arguments; empty where there is none."""
    for i in range(1, len(arguments)):
        if arguments[i] == COMMAND and arguments[i - 1] in ("-c", "--command"):
            files = [one for one in arguments[: i - 1] if re.search(r"\.blend\d*$", one, re.IGNORECASE)]
            return files[-1] if files else ""
    return ""


def _why_unopened(path: str) -> str:
    if not Path(path).is_file():
        return f"There is no file {path}: check the path."
    return f"{path} cannot be opened by Blender {bpy.app.version_string}: check that it is a .blend file, and whole."


def _bake(options: Options, progress: Progress, report: Report, baked: Callable[[], None]) -> list[str]:
    """Bake and save; returns sentences about what could not be written where something else was."""
    for path in (options.save, options.report):
        if path is not None:
            check_writable(path)
    failures: list[str] = []
    meshes = {obj: obj.data for obj in bpy.data.objects if obj.type == "MESH"} if options.refine else {}
    counts = {}
    try:
        if options.refine is not None:
            counts = _refine(options, options.refine, progress, report)
        if options.frames is None:
            failures += _bake_frame(options, progress, report)
            baked()
        else:
            failures += _bake_frames(options, options.frames, progress, report, baked)
    except BaseException:
        for obj, mesh in meshes.items():
            if obj.data != mesh:
                obj.data = mesh
        raise
    if options.save is not None:
        progress.update(SAVING, 0)
        saved, failure = _save_somewhere(options.save)
        report.saved = str(saved) if saved else ""
        failures += failure
        with suppress(Cancelled):  # too late: it is saved
            progress.update(SAVING, 1)
    report.counts |= counts
    report.status = "failed" if failures else "done"
    return failures


def _refine(options: Options, refine: RefineOptions, progress: Progress, report: Report) -> dict[str, int]:
    """Give objects refined copies of their meshes; returns how many there are, and vertices in them."""
    request = RefineRequest(refine, on_copy=True)
    with hushed(1):
        job = BakeJob.prepare(bpy.context, [request], progress, options.objects, options.light_group)
    solved = job.solve(draft_of(options.settings), progress)
    job.write(solved, progress)
    report.warnings = job.warnings
    return {name: solved.counts[name] for name in ("refined_meshes", "added_vertices")}


def _bake_frames(
    options: Options, frames: Frames, progress: Progress, report: Report, baked: Callable[[], None]
) -> list[str]:
    """Bake what is asked for in several frames; returns sentences about what could not be written."""

    def of_vertices(request: VertexRequest) -> VertexRecording:
        name = scene_name(bpy.context.scene)
        return VertexRecording(request, frames, options.keeping, options.playback_output, name)

    recordings = [recording_of(request, frames, of_vertices) for request in _requests(options)]
    bakes, failures = FrameBakes(frames, recordings), []
    try:
        for time in frames.times:
            bakes.go_to(time)
            failures += _bake_frame(options, progress, report, bakes, time)
            baked()
        bakes.go_back()
        written = bakes.finish()
    finally:
        bakes.go_back()
    report.warnings = list(dict.fromkeys([*report.warnings, *written.warnings, *_show(options)]))
    report.files += [str(path) for path in written.files]
    report.counts |= {"frames": len(frames), "repeated_frames": bakes.n_repeated}
    return failures + written.failures


def _bake_frame(
    options: Options, progress: Progress, report: Report, bakes: FrameBakes | None = None, time: float = 0.0
) -> list[str]:
    """Bake what is asked for in the current frame; the report has the files of all frames, and else the last one's.

    Returns
    -------
    list of str
        Sentences about what could not be written.
    """
    requests, named = bakes.requests(time) if bakes else _requests(options), (options.objects, options.light_group)
    earlier, job = report.warnings, None
    try:
        with hushed(1):  # Cycles' log, where it evaluates nodes
            apart, steps = options.light_groups, options.settings.motion_blur
            job = BakeJob.prepare(bpy.context, requests, progress, *named, options.strict, apart, steps)
        job.check_strict()
        if not report.files:
            job.check_space(len(options.frames or [0]), options.save)
        solved = job.solve(options.settings, progress, before=bakes.before if bakes else None)
        written = bakes.take(time, job, solved, progress) if bakes else job.write(solved, progress)
        job.warnings += [] if bakes else _show(options)
    finally:
        report.warnings = list(dict.fromkeys([*earlier, *(job.warnings if job else [])]))
    report.objects = job.object_names
    report.files += [str(path) for path in written.files]
    report.counts = {**job.counts, **solved.counts}
    report.relative_noise = solved.relative_noise
    return written.failures


def _show(options: Options) -> list[str]:
    """Show the light in materials if that is asked for, or if it was shown before; returns warnings."""
    scene = bpy.context.scene
    if options.show:  # the panel's strength and switch are to go on with what is shown
        scene.photon_bake.attribute, scene.photon_bake.targets = options.attribute, set(options.targets)
    return shown_after_bake(scene, options.show)


def _requests(options: Options) -> list[Request]:
    """What is baked; lightmaps first, as files may fail to be written, and then nothing else should be."""
    requests: list[Request] = []
    scene = scene_name(bpy.context.scene)
    attribute = options.attribute if "vertex" in options.targets else ""
    groups = group_names(bpy.context.view_layer, attribute) if options.light_groups else ()
    if options.lightmaps is not None:
        of_lightmaps = options.preview, groups, options.copies
        requests.append(LightmapRequest(options.lightmaps, options.output, scene, *of_lightmaps))
    if options.camera is not None:
        requests.append(CameraRequest(options.camera, options.camera_output, groups))
    if options.probes is not None:
        requests.append(ProbeRequest(options.probes, options.probe_output, scene))
    if "vertex" in options.targets:
        requests.append(VertexRequest(options.attribute, options.copies, groups, options.fit, options.denoise))
    return requests


def _save_somewhere(path: Path) -> tuple[Path | None, list[str]]:
    """Save the open file as `path`, or where that fails for temporary files: light that took hours is not lost.

    Returns
    -------
    Path or None
        Where it is saved.
    list of str
        A sentence if that is not `path`.
    """
    try:
        _save(path)
    except (OSError, RuntimeError, BakeError) as error:
        reason = getattr(error, "strerror", None) or str(error).strip()
    else:
        return path, []
    refuge = Path(mkdtemp(prefix="photon_bake_"), path.name)
    try:
        _save(refuge)
    except (OSError, RuntimeError, BakeError):
        rmtree(refuge.parent, ignore_errors=True)
        return None, [f"{path} could not be saved ({reason}), nor {refuge}: make room and bake again."]
    return refuge, [f"{path} could not be saved ({reason}); the baked file is {refuge}: move it."]


def _save(path: Path) -> None:
    """Save the open file as `path`, whole or not at all, and go on with the open one."""
    loaded = Path(bpy.data.filepath)
    compress = loaded.is_file() and loaded.read_bytes()[:7] != b"BLENDER"
    with atomic_path(path) as temporary, hushed(1):  # Blender says that it saved the temporary file
        bpy.ops.wm.save_as_mainfile(
            filepath=str(temporary), copy=True, relative_remap=True, compress=compress, check_existing=False
        )
        if not temporary.is_file():
            raise BakeError("is the disk full?")


def _begin(options: Options) -> Report:
    return Report(
        scene=bpy.data.filepath,
        attribute=options.attribute if "vertex" in options.targets else "",
        light_group=options.light_group,
        light_groups=options.light_groups,
        settings=asdict(options.settings),
        lightmap_settings=asdict(options.lightmaps) if options.lightmaps else {},
        camera_settings=asdict(options.camera) if options.camera else {},
        probe_settings=asdict(options.probes) if options.probes else {},
        versions=versions(),
    )


def _end(report: Report, progress: Progress, options: Options, status: int, baked: bool) -> int:
    """Say how it went, and write the report."""
    report.stage_seconds = progress.stage_seconds
    report.peak_memory_mb = peak_memory_mb()
    if baked:
        report.message = f"{_summary(report)} {report.message}".strip()
    for warning in report.warnings:
        say(f"warning: {warning}")
    say(report.message)
    if options.report is not None:
        try:
            report.write(options.report)
        except OSError as error:
            if status == DONE:  # otherwise what went wrong is said already
                say(f"The report {options.report} could not be written ({error.strerror}).")
                return FAILED
    return status


def _summary(report: Report) -> str:
    noise = f", noise {report.relative_noise:.1%}" if report.relative_noise else ""
    memory = f", {report.peak_memory_mb:.0f} MB at most" if report.peak_memory_mb else ""
    places = [("object", len(report.objects)), ("lightmap", report.counts.get("lightmaps", 0))]
    places.append(("camera's pass", report.counts.get("camera_passes", 0)))
    n_probes = report.counts.get("probes", 0)
    places.append(("probe", n_probes))
    where = " and ".join(f"{n} {thing}" + ("s" if n != 1 else "") for thing, n in places if n)
    saved = f"; saved to {report.saved}" if report.saved else "; not saved"
    return (
        f"Baked {report.counts['receivers'] + n_probes:,} points of {where or 'nothing'} "
        f"in {duration(report.total_seconds)}{noise}{memory}{saved}."
    )


_handles: list[Any] = []


def register() -> None:
    """Add the command."""
    _handles.append(bpy.utils.register_cli_command(COMMAND, run))
    if bpy.app.module:
        atexit.register(unregister)  # version 4.5 of the module crashes at its end on a command still registered


def unregister() -> None:
    """Take it away again; the module's end and Blender's may both ask for it."""
    while _handles:
        bpy.utils.unregister_cli_command(_handles.pop())
