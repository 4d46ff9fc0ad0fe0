"""Light that is kept: bakes that go on, and shards of frames, to the same bits."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import bpy
import numpy as np
import pytest
from photon_bake.addon.core.errors import BakeError
from photon_bake.addon.output.archive import read_archive, write_archive
from photon_bake.operators.command_line.command import run
from photon_bake.operators.jobs.light_store import KeptLight

from .camera_scenes import add_camera
from .scenes import add_cube, add_lamp, add_plane
from .test_frames import colors_of, pixels_of

QUICK = ["--quality", "draft", "--photons", "5000", "--gather-rays", "32"]
TARGETS = ["--target", "vertex", "--target", "lightmap", "--size", "32", "--atlas", "shared", "--frames", "1-4"]
ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def room(empty_scene):
    """A floor, and a box that rises."""
    add_plane("Floor", size=8.0)
    box = add_cube("Box")
    add_lamp("POINT", location=(1.5, 0.5, 4), energy=1000)
    add_camera(bpy.context.scene, (0, -6, 3))
    for frame in (1, 4):
        box.location.z = 0.5 + 0.5 * frame
        box.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(1)


def bake(out, *options, status=0):
    assert run([*QUICK, *TARGETS, "--output", str(out), *options]) == status


def found_in(out):
    """All that a bake has written: pixels by file, and what the floor plays at each frame."""
    pixels = {path.name: pixels_of(path) for path in sorted(out.iterdir())}
    played = []
    for frame in range(1, 5):
        bpy.context.scene.frame_set(frame)
        played.append(colors_of("Floor", evaluated=True))
    bpy.context.scene.frame_set(1)
    return pixels, played


def assert_same(one, other):
    assert one[0].keys() == other[0].keys()
    for name, pixels in one[0].items():
        assert np.array_equal(pixels, other[0][name]), name
    assert np.array_equal(one[1], other[1])


@pytest.mark.parametrize("n", [1, 3, 7])
def test_shards_give_the_same_bits(room, tmp_path, n):
    whole, parts, state = tmp_path / "whole", tmp_path / "parts", tmp_path / "state"
    bake(whole, "--threads", "1")
    unbroken = found_in(whole)
    bpy.ops.photon_bake.remove_playback()
    for k in range(n, 0, -1):
        bake(parts, "--state", str(state), "--shard", f"{k}/{n}", "--threads", "2")
    assert not parts.exists() and not bpy.data.objects["Floor"].modifiers and len(list(state.iterdir())) == 4
    bake(parts, "--state", str(state), "--merge")
    assert_same(unbroken, found_in(parts))


def test_a_missing_shard_is_named(room, tmp_path, capfd):
    bake(tmp_path / "out", "--state", str(tmp_path / "state"), "--shard", "1/2")
    bake(tmp_path / "out", "--state", str(tmp_path / "state"), "--merge", status=1)
    assert "has no light of frame 2 with these settings" in capfd.readouterr().err
    assert not bpy.data.objects["Floor"].modifiers


def test_light_of_other_settings_is_not_taken(room, tmp_path, capfd):
    state = tmp_path / "state"
    bake(tmp_path / "out", "--state", str(state))
    bake(tmp_path / "out", "--state", str(state), "--merge", "--seed", "1", status=1)
    assert "has no light of frame 1 with these settings" in capfd.readouterr().err


def test_what_has_changed_is_solved_and_the_rest_is_taken(room, tmp_path):
    state, report = tmp_path / "state", tmp_path / "report.json"
    bake(tmp_path / "out", "--state", str(state))
    lamp = bpy.data.lights[0]
    for frame, energy in ((2, 1000), (3, 1500)):
        lamp.energy = energy
        lamp.keyframe_insert("energy", frame=frame)
    bake(tmp_path / "out", "--state", str(state), "--resume", "--report", str(report))
    assert json.loads(report.read_text())["counts"]["found_frames"] == 2


def test_all_targets_are_kept(room, tmp_path):
    every = ["--target", "camera", "--target", "probes", "--frames", "1-1", "--pixel-samples", "1"]
    bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = 32
    found = []
    for options in (["--state", str(tmp_path / "state")], ["--state", str(tmp_path / "state"), "--merge"]):
        assert run([*QUICK, *every, "--output", str(tmp_path / "out"), *options]) == 0
        found.append({path.name: path.read_bytes() for path in (tmp_path / "out").iterdir() if path.suffix == ".json"})
        found[-1] |= {p.name: pixels_of(p) for p in (tmp_path / "out").glob("*indirect*.exr")}
    assert found[0].keys() == found[1].keys() and len(found[0]) == 2
    assert all(np.array_equal(value, found[1][name]) for name, value in found[0].items())


def test_a_damaged_file_is_named(room, tmp_path, capfd):
    state = tmp_path / "state"
    bake(tmp_path / "out", "--state", str(state))
    for path in state.iterdir():
        data = bytearray(path.read_bytes())
        data[len(data) // 2] ^= 255
        path.write_bytes(data)
    bake(tmp_path / "out", "--state", str(state), "--resume", status=1)
    said = capfd.readouterr().err
    assert "cannot be read as baked light: remove it" in said or "is damaged: remove it" in said


def killed_and_resumed(tmp_path, n_kills, seconds):
    """A bake that is killed so many times, about so many seconds after its first light, and gone on with."""
    blend, state, out = tmp_path / "scene.blend", tmp_path / "state", tmp_path / "out"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    command = [sys.executable, str(ROOT / "tools" / "blender_stand_in.py"), "-b", str(blend), "-c", "photon_bake"]
    command += [*QUICK, *TARGETS, "--output", str(out), "--state", str(state), "--resume"]
    for i in range(n_kills):
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        began = len(list(state.glob("*.npz"))) if state.exists() else 0
        deadline = time.monotonic() + 300
        while process.poll() is None and time.monotonic() < deadline:
            if state.exists() and len(list(state.glob("*.npz"))) > began:
                break
            time.sleep(0.01)
        time.sleep(seconds * (i * 0.618034 % 1))
        process.send_signal(signal.SIGKILL)
        process.wait()
    done = subprocess.run([*command, "--save", str(tmp_path / "done.blend")], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()
    return out


@pytest.mark.parametrize("n_kills", [2, pytest.param(30, marks=pytest.mark.long)])
def test_a_killed_bake_goes_on_to_the_same_bits(room, tmp_path, n_kills):
    out = killed_and_resumed(tmp_path, n_kills, 0.5)
    assert not [path for path in out.iterdir() if path.name.startswith(".")] or os.name == "nt"
    bake(tmp_path / "whole")
    names = sorted(path.name for path in (tmp_path / "whole").iterdir() if "Atlas" in path.name)
    for name in names:
        assert np.array_equal(pixels_of(out / name.replace("Scene", "scene")), pixels_of(tmp_path / "whole" / name))


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--resume"], "give --state DIR"),
        (["--state", "x", "--shard", "1/2", "--merge", "--frames", "1-2"], "give one of them"),
        (["--state", "x", "--shard", "1/2"], "give --frames"),
        (["--state", "x", "--shard", "3/2", "--frames", "1-2"], "no shard"),
        (["--state", "x", "--shard", "1/2", "--frames", "1-2", "--save", "x.blend"], "with --merge"),
        (["--state", "x", "--motion-blur"], "leave --motion-blur out"),
    ],
)
def test_bad_usage(room, options, sentence, capfd):
    assert run([*QUICK, "--output", "y", "--target", "lightmap", *options]) == 2
    assert sentence in " ".join(capfd.readouterr().err.split())


def test_archives_know_their_classes(tmp_path):
    kept = KeptLight(np.arange(3.0), [None], [[{"a": (1, 2.5, "b", True)}]], False, [], ["x"], [])
    write_archive(tmp_path / "a.npz", kept, {"numpy": "2"})
    read, about = read_archive(tmp_path / "a.npz", [KeptLight])
    assert np.array_equal(read.total, kept.total) and about == {"numpy": "2"}
    assert read.samples == [[{"a": [1, 2.5, "b", True]}]]
    (tmp_path / "b.npz").write_bytes(b"nothing")
    with pytest.raises(BakeError, match="cannot be read as baked light"):
        read_archive(tmp_path / "b.npz", [KeptLight])
