"""What media scatter to a camera, against Cycles' pass Volume Indirect: time at equal error.

A room of fog that a camera looks into, and the same with a ball of glass below the lamp. Errors are relative RMSE over
all pixels, told by two renders of Cycles, whose noise does not count as they are independent.
"""

from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import bpy
import numpy as np
from camera_pass import samples_for
from figures import ROOT, table
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.output.oidn import filtered
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.settings.camera import CameraSettings
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.camera import CameraRequest
from photon_bake.tests.host.camera_scenes import add_ball, add_fog, build_room, coloured
from photon_bake.tests.host.cycles_passes import render_passes

SIZE = 240, 160
TRUTH_SAMPLES = 384
LEVELS = (4, 16, 64)  # samples
HEAD = ["Fog", "Time, s", "Error", "Mean", "Cycles, s", "times", "Twice the error, s", "Cycles and OIDN, s", "times"]
TITLE = "Media before a camera: time at equal error, against Cycles' Volume Indirect"


def room(with_glass):
    """A room of fog."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    build_room(scene, SIZE)
    add_fog(scene, Density=0.5)
    if with_glass:
        add_ball("Glass", (0, -0.1, 0.4), 0.4, coloured("Glass", (1, 1, 1), "ShaderNodeBsdfGlass", Roughness=0.0))
    bpy.context.view_layer.cycles.use_pass_volume_indirect = True
    return scene


def rendered(scene, samples, seed):
    """Cycles' Volume Indirect, and the seconds that it takes."""
    scene.cycles.seed, start = seed, perf_counter()
    passes = render_passes(scene, Path(bpy.app.tempdir) / "media.exr", samples)
    return np.stack([passes[f"VolumeInd.{c}"] for c in "RGB"], axis=-1), perf_counter() - start


def ours(quality):
    """Our layer Volume, and the seconds of the whole pass."""
    start, progress = perf_counter(), Progress()
    with TemporaryDirectory() as folder:
        job = BakeJob.prepare(bpy.context, [CameraRequest(CameraSettings(), Path(folder))], progress)
        solved = job.solve(settings_for(quality), progress)
        job.write(solved, progress)
    return solved.outputs[0].passes, perf_counter() - start


def truth_of(name, scene):
    """Two renders, kept for the next time."""
    path = ROOT / f"build/truth/media_{name}_{SIZE[0]}x{SIZE[1]}_{TRUTH_SAMPLES}.npy"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        np.save(path, np.stack([rendered(scene, TRUTH_SAMPLES, seed)[0] for seed in (1, 2)]))
    return np.load(path)


def measure(name, with_glass):
    """A row of `HEAD`."""
    scene = room(with_glass)
    a, b = truth_of(name, scene)
    mean = float((a + b).mean()) / 2

    def error(x):
        return np.sqrt(max(float(np.mean((x - a) * (x - b))), 0.0)) / mean

    ours("draft")  # reads kernels
    passes, seconds = ours("medium")
    own, found = error(passes.volume), [rendered(scene, samples, 3) for samples in LEVELS]
    per_sample = (found[-1][1] - found[0][1]) / (LEVELS[-1] - LEVELS[0])
    guides = {"albedo": np.clip(passes.albedo, 0, 1), "normal": passes.normal}
    plain = [error(x) for x, _ in found]
    smooth = [error(filtered("RT", x, {"hdr": True, "cleanAux": True}, guides)) for x, _ in found]
    by_cycles, by_half, by_both = (
        samples_for(at, LEVELS, errors) * per_sample for at, errors in ((own, plain), (2 * own, plain), (own, smooth))
    )
    print(f"{name}: Cycles {per_sample:.3f} s a sample; errors at {LEVELS}: {plain}, denoised {smooth}", flush=True)
    cells = [f"{seconds:.1f}", f"{own:.2%}", f"{passes.volume.mean() / mean - 1:+.2%}"]
    cells += [f"{by_cycles:.0f}", f"{by_cycles / seconds:.1f}", f"{by_half:.0f}", f"{by_both:.1f}"]
    return [name, *cells, f"{by_both / seconds:.2f}"]


def tables(*_):
    """The table of `make bench`."""
    return [table(f"{TITLE}, {SIZE[0]} × {SIZE[1]}", HEAD, [measure("room", False), measure("glass", True)])]


if __name__ == "__main__":
    tables()
