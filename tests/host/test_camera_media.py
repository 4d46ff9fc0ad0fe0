"""A camera's pass of a room of fog, against Cycles' own passes."""

import bpy
import numpy as np
import pytest
from photon_bake.addon.blender.compositing.nodes import add_pass
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.settings.camera import CameraSettings
from photon_bake.operators.jobs.bake_job import BakeJob
from photon_bake.operators.targets.camera import CameraRequest
from photon_bake.tests.host.camera_scenes import add_ball, add_fog, build_room, coloured
from photon_bake.tests.host.cycles_passes import render_passes
from photon_bake.tests.host.scenes import set_world
from photon_bake.tests.host.test_compositor import bake_pass, composed


def our_pass(folder, **settings):
    """The pass of the scene's camera."""
    job = BakeJob.prepare(
        bpy.context, [CameraRequest(CameraSettings(pass_denoiser="none", **settings), folder)], Progress()
    )
    solved = job.solve(settings_for("medium", n_photons=400_000, n_cache_rays=64), Progress())
    return solved.outputs[0].passes


def picture(channels, name):
    return np.stack([channels[f"{name}.{c}"] for c in "RGB"], axis=-1)


def blocks(image):
    return image.reshape(4, 8, 6, 8, 3).mean(axis=(1, 3))


@pytest.mark.parametrize("fog", [{"Density": 0.5, "Anisotropy": 0.3}, {"Density": 1.0, "Color": (0.9, 0.6, 0.3, 1)}])
def test_what_fog_scatters_is_cycles_pass(empty_scene, tmp_path, fog):
    """VolumeInd in means over blocks of 8 × 8 pixels, beside a lamp in the fog noisy in both; and the mean of all."""
    build_room(empty_scene)
    add_fog(empty_scene, **fog)
    layer = bpy.context.view_layer
    layer.cycles.use_pass_volume_indirect = layer.use_pass_diffuse_color = True
    truth = render_passes(empty_scene, tmp_path / "cycles.exr", samples=1024)
    ours = our_pass(tmp_path, n_media_rays=256)
    found, expected = blocks(ours.volume), blocks(picture(truth, "VolumeInd"))
    assert found.mean(axis=(0, 1)) == pytest.approx(expected.mean(axis=(0, 1)), rel=0.02)
    assert np.sqrt(np.mean((found - expected) ** 2)) < 0.04 * expected.mean()
    assert blocks(ours.albedo) == pytest.approx(blocks(picture(truth, "DiffCol")), rel=0.03, abs=0.005)


@pytest.mark.parametrize("ball", [None, "ShaderNodeBsdfAnisotropic", "ShaderNodeBsdfGlass"])
def test_direct_light_and_the_pass_are_the_full_render_of_a_room_of_fog(empty_scene, tmp_path, ball):
    """Means over blocks of 8 × 8 pixels; with a mirror, or glass, in the fog before and behind it."""
    build_room(empty_scene)
    add_fog(empty_scene, Density=0.4)
    if ball:
        set_world((1, 1, 1))
        bpy.data.objects.remove(bpy.data.objects["Lamp"])
        add_ball("Ball", (0.3, -0.1, -0.3), 0.5, coloured("Ball", (0.9, 0.8, 0.7), ball, Roughness=0.0))
    full = picture(render_passes(empty_scene, tmp_path / "full.exr", samples=512), "Combined")
    add_pass(empty_scene, [bake_pass(tmp_path, n_media_rays=64)])
    ours = composed(empty_scene, tmp_path / "ours.exr", 128)
    off = np.abs(blocks(ours) - blocks(full)).max(axis=2) / blocks(full).mean()
    assert ours.mean() == pytest.approx(full.mean(), rel=0.02)
    assert np.sqrt((off**2).mean()) < 0.03 and off.max() < 0.1


def test_what_a_glass_ball_focuses_in_fog(empty_scene, tmp_path):
    """Volume, with what photons bring through glass, against VolumeInd; the lamp is large, so that Cycles finds it."""
    build_room(empty_scene)
    add_fog(empty_scene, Density=1.0)
    bpy.data.lights[0].size = 1.0
    add_ball("Glass", (0, -0.1, 0.4), 0.4, coloured("Glass", (1, 1, 1), "ShaderNodeBsdfGlass", Roughness=0.0))
    bpy.context.view_layer.cycles.use_pass_volume_indirect = True
    expected = blocks(picture(render_passes(empty_scene, tmp_path / "cycles.exr", samples=4096), "VolumeInd"))
    found = blocks(our_pass(tmp_path, n_media_rays=128).volume)
    assert found.mean(axis=(0, 1)) == pytest.approx(expected.mean(axis=(0, 1)), rel=0.02)
    assert np.sqrt(np.mean((found - expected) ** 2)) < 0.05 * expected.mean()
