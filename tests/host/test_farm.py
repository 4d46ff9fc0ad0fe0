"""The template for farms: steps and tasks that give the same bits as one bake."""

import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest
from photon_bake.operators.command_line.command import run

from .scenes import add_cube, add_lamp, add_plane
from .test_frames import pixels_of

ROOT = Path(__file__).resolve().parents[2]
TEMPLATE = ROOT / "tools" / "farm" / "photon_bake.openjd.yaml"
OPTIONS = ["--target", "lightmap", "--atlas", "shared", "--size", "32", "--quality", "draft", "--photons", "5000"]


@pytest.fixture
def openjd():
    """The command of openjd-cli."""
    command = Path(sys.executable).with_name("openjd")
    if not command.is_file():
        pytest.skip("openjd-cli is not installed")
    return str(command)


def test_the_template_is_valid(openjd):
    checked = subprocess.run([openjd, "check", str(TEMPLATE)], capture_output=True, text=True, check=False)
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_a_job_gives_the_bits_of_one_bake(openjd, empty_scene, tmp_path):
    add_plane("Floor", size=8.0)
    box = add_cube("Box")
    add_lamp("POINT", location=(1.5, 0.5, 4), energy=1000)
    for frame in (1, 3):
        box.location.z = float(frame)
        box.keyframe_insert("location", frame=frame)
    blend, whole, out = tmp_path / "scene.blend", tmp_path / "whole", tmp_path / "out"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    parameters = {
        "BlendFile": blend,
        "Output": out,
        "Saved": tmp_path / "baked.blend",
        "Frames": "1-3",
        "Shards": 2,
        "Options": " ".join(OPTIONS),
        "Blender": f"{sys.executable} {ROOT / 'tools' / 'blender_stand_in.py'}",
    }
    command = [openjd, "run", str(TEMPLATE), "--step", "Merge", "--run-dependencies"]
    command += [word for name, value in parameters.items() for word in ("-p", f"{name}={value}")]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert (tmp_path / "baked.blend").is_file() and len(list((out / "state").iterdir())) == 3
    assert run([*OPTIONS, "--frames", "1-3", "--output", str(whole)]) == 0
    for path in whole.iterdir():
        assert np.array_equal(pixels_of(path), pixels_of(out / path.name)), path.name
