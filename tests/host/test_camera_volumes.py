"""Photon volumes in the camera's pass: against Cycles, and for nothing but a camera."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.settings.camera import CameraSettings
from photon_bake.addon.ui.state import CAMERA_SHARES, STAGE_SHARES, share_done
from photon_bake.operators.command_line.command import run
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.camera import CameraRequest

from .camera_scenes import build_room
from .cycles_passes import render_passes


def blocks(picture):
    """Means over 8 × 8 pixels of a picture (32, 48, 3)."""
    return picture.reshape(4, 8, 6, 8, 3).mean(axis=(1, 3))


def test_light_is_cycles_diffuse_indirect(empty_scene, tmp_path):
    """Within what 600,000 photons and 150 samples leave of noise and blur: 3 % of blocks' mean, 1 % of the whole."""
    build_room(empty_scene)
    bpy.context.view_layer.use_pass_diffuse_indirect = True
    theirs = render_passes(empty_scene, tmp_path / "cycles.exr", samples=150)
    name = "DiffInd" if "DiffInd.R" in theirs else "Diffuse Indirect"
    theirs = np.stack([theirs[f"{name}.{c}"] for c in "RGB"], axis=-1)
    job = BakeJob.prepare(bpy.context, [CameraRequest(CameraSettings(), tmp_path)], Progress())
    settings = settings_for("draft", gather="photon_volumes", n_photons=600_000, subsample=1)
    ours = job.solve(settings, Progress()).outputs[0].passes.indirect_diffuse
    off = np.abs(blocks(ours) - blocks(theirs)).max(axis=2) / blocks(theirs).mean()
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.015)
    assert np.sqrt((off**2).mean()) < 0.045 and off.max() < 0.09


def test_the_progress_bar_knows_every_stage(empty_scene, tmp_path):
    build_room(empty_scene, (24, 16))
    shown, done, shares = {}, [], STAGE_SHARES["photon_volumes"] | CAMERA_SHARES

    def listen(stage, fraction):
        shown[stage] = fraction
        done.append(share_done(shares, shown))

    progress = Progress(listen)
    job = BakeJob.prepare(bpy.context, [CameraRequest(CameraSettings(), tmp_path)], progress)
    job.solve(settings_for("draft", gather="photon_volumes", n_photons=20_000, add_direct=True), progress)
    assert set(STAGE_SHARES["photon_volumes"]) <= set(shown)
    assert done == sorted(done)


@pytest.mark.parametrize("targets", [["vertex"], ["lightmap"], ["camera", "vertex"]])
def test_other_targets_are_refused(targets, tmp_path, capfd):
    arguments = [word for target in targets for word in ("--target", target)]
    if targets != ["vertex"]:
        arguments += ["--output", str(tmp_path)]
    assert run([*arguments, "--gather", "photon_volumes"]) == 2
    assert "give --target camera alone, or another --gather" in capfd.readouterr().err
    assert not any(tmp_path.iterdir())
