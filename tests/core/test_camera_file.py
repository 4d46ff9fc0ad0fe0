"""A camera's pass in its file: channels, formats, names, and whole whatever happens."""

import os
import signal
import time
import warnings

import numpy as np
import OpenEXR
import pytest
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.output.camera import CameraPass, PictureFrame, denoised, frame_path, write_camera_pass
from photon_bake.addon.output.oidn import has_oidn
from photon_bake.addon.settings.camera import PASS_CHOICES, CameraSettings


def a_pass(height=12, width=20, level=1.0):
    random = np.random.default_rng(0)
    colours = (random.random((5, height, width, 3)) * level).astype(np.float32)
    depth = (1e6 * random.random((height, width))).astype(np.float32)
    return CameraPass(*colours, depth=depth, error=colours[0, ..., 0])


def read(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: np.array(channel.pixels) for name, channel in file.channels().items()}


@pytest.mark.parametrize("compression", PASS_CHOICES["compression"])
@pytest.mark.parametrize("half", [True, False])
def test_file_holds_the_pass(tmp_path, compression, half):
    passes, path = a_pass(), tmp_path / "pass.exr"
    write_camera_pass(path, passes, PictureFrame(20, 12), {"Camera": "Mine"}, half, compression)
    channels = read(path)
    lossy = compression.startswith("dwa")
    assert len(channels) == 5 * 3 + 3 + 2 and all(name.startswith("PhotonBake.") for name in channels)
    depth = channels.pop("PhotonBake.Depth.Z")
    assert depth.dtype == np.float32 and depth == pytest.approx(passes.depth, rel=1e-2 if lossy else 0)
    assert {str(values.dtype) for values in channels.values()} == {"float16" if half else "float32"}
    bound = 0.05 if lossy else 1e-3 if half else 0
    for i, c in enumerate("RGB"):
        assert channels[f"PhotonBake.Indirect.{c}"] == pytest.approx(passes.indirect[..., i], rel=bound, abs=bound)
        assert channels[f"PhotonBake.Caustics.{c}"] == pytest.approx(passes.caustics[..., i], rel=bound, abs=bound)
    with OpenEXR.File(str(path)) as file:
        assert file.header()["Camera"] == "Mine"


def test_a_region_lies_in_its_frame(tmp_path):
    passes = a_pass()
    write_camera_pass(tmp_path / "pass.exr", passes, PictureFrame(30, 25, column=4, row=9), {}, half=False)
    depth = read(tmp_path / "pass.exr")["PhotonBake.Depth.Z"]
    assert depth.shape == (25, 30) and np.array_equal(depth[9:21, 4:24], passes.depth)
    assert depth.sum(dtype=np.float64) == pytest.approx(passes.depth.sum(dtype=np.float64))


@pytest.mark.parametrize(
    ("pattern", "name"),
    [("a_####", "a_0007.exr"), ("a", "a0007.exr"), ("##/b#".replace("/", "-"), "##-b7.exr"), ("#.x", "7.x.exr")],
)
def test_frame_s_number_takes_the_place_of_the_signs(tmp_path, pattern, name):
    assert frame_path(tmp_path, pattern, 7) == tmp_path / name


@pytest.mark.parametrize("name", ["", "a/b", "a:b"])
def test_names_that_are_none(name):
    with pytest.raises(BakeError):
        CameraSettings(file_name=name)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_killed_at_any_moment_it_leaves_a_whole_file(tmp_path):
    """A process writes two passes in turn, and is killed fifty times: the file is always one of them."""
    path, levels = tmp_path / "pass.exr", (1.0, 2.0)
    whole = [a_pass(level=level) for level in levels]
    write_camera_pass(path, whole[0], PictureFrame(20, 12), {}, half=False)
    random = np.random.default_rng(0)
    found = set()
    for _ in range(50):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # of forks beside threads, of which the child has none
            child = os.fork()
        if child == 0:
            while True:
                for passes in reversed(whole):
                    write_camera_pass(path, passes, PictureFrame(20, 12), {}, half=False)
        time.sleep(0.002 + 0.02 * random.random())
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        caustics = read(path)["PhotonBake.Caustics.R"]
        level = [k for k, passes in enumerate(whole) if np.array_equal(caustics, passes.caustics[..., 0])]
        assert len(level) == 1
        found.add(level[0])
    assert found == {0, 1}


@pytest.mark.skipif(not has_oidn(), reason="OpenImageDenoise is not installed")
def test_denoising_keeps_edges_that_normals_tell_and_the_mean():
    """Noise of 20 % on two walls of different light, which meet at a corner."""
    random, (height, width) = np.random.default_rng(0), (96, 128)
    left = np.arange(width)[None, :, None] < 50
    light = np.where(left, 0.2, 1.0) * np.ones((height, width, 3))
    normal = np.where(left, [1.0, 0, 0], [0, 0, 1.0]) * np.ones((height, width, 1))
    nothing = np.zeros((height, width, 3), np.float32)
    noisy = (light * random.normal(1, 0.2, light.shape)).astype(np.float32)
    albedo = np.full_like(nothing, 0.5)
    passes = CameraPass(noisy, nothing, nothing, albedo, normal.astype(np.float32), nothing[..., 0], nothing[..., 0])
    assert np.array_equal(denoised(passes, diffuse=False).indirect_diffuse, noisy)
    clean = denoised(passes, diffuse=True)
    error = np.sqrt(((clean.indirect_diffuse - light) ** 2).mean())
    assert error < 0.15 * np.sqrt(((noisy - light) ** 2).mean())
    assert clean.indirect_diffuse.mean() == pytest.approx(light.mean(), rel=0.01)
    assert np.array_equal(clean.albedo, albedo) and not clean.glossy.any()
