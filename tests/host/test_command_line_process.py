"""The command photon_bake through the stand-in for the blender executable, in a process of its own."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import bpy
import pytest

from .scenes import add_cube, add_lamp, add_plane

STAND_IN = Path(__file__).resolve().parents[2] / "tools" / "blender_stand_in.py"

pytestmark = pytest.mark.skipif(not bpy.app.module, reason="the stand-in runs on the bpy module")


@pytest.fixture
def blend(empty_scene, tmp_path):
    add_plane("Floor", size=8.0)
    add_cube("Box").location.z = 1.0
    add_lamp("POINT", location=(1.5, 0.5, 4), energy=1000)
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    return path


def stand_in(*arguments, **options):
    command = [sys.executable, str(STAND_IN), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, **options)


def test_bake_and_save(blend):
    save = blend.with_name("baked.blend")
    done = stand_in("-b", blend, "-c", "photon_bake", "--quality", "draft", "--save", save)
    assert done.returncode == 0, done.stderr
    bpy.ops.wm.open_mainfile(filepath=str(save))
    assert "Indirect" in bpy.data.objects["Box"].data.attributes


def test_blender_starts_without_the_libraries():
    libraries = ("scipy", "embreex", "OpenEXR", "numba", "llvmlite")
    heavy = f"[name for name in sys.modules if name.split('.')[0] in {libraries}]"
    done = stand_in("--python-expr", f"import sys; print('loaded:', {heavy})")
    assert "loaded: []" in done.stdout


def test_exit_statuses(blend, tmp_path):
    assert stand_in("-b", blend, "-c", "photon_bake", "--help").returncode == 0
    assert stand_in("-b", blend, "-c", "photon_bake", "--objects", "Nobody").returncode == 1
    assert stand_in("-b", blend, "-c", "photon_bake", "--target", "camera").returncode == 1  # the file has none
    assert stand_in("-b", blend, "-c", "photon_bake", "--target", "nowhere").returncode == 2
    assert stand_in("-b", tmp_path / "missing.blend", "-c", "photon_bake").returncode == 1
    assert stand_in("-c", "no_such_command").returncode == 2
    assert stand_in("--no-such-option").returncode == 2


def test_scripts_and_their_arguments(blend, tmp_path):
    script = tmp_path / "script.py"
    script.write_text("import bpy, sys\nprint(sorted(bpy.data.objects.keys()), sys.argv[sys.argv.index('--') + 1:])")
    done = stand_in("-b", blend, "--factory-startup", "--python", script, "--", "-c", "nothing")
    assert done.returncode == 0 and "['Box', 'Floor', 'Lamp'] ['-c', 'nothing']" in done.stdout
    assert stand_in("--python-expr", "1 / 0").returncode == 1


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT to send")
def test_ctrl_c(blend):
    before = blend.read_bytes()
    command = [
        sys.executable,
        str(STAND_IN),
        "-b",
        str(blend),
        "-c",
        "photon_bake",
        "--save",
        "--photons",
        "1000000000",
    ]
    with subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True) as process:
        said = ""
        while "Tracing photons" not in said:
            said += (line := process.stderr.readline())
            assert line, said
        process.send_signal(signal.SIGINT)
        rest = process.communicate(timeout=60)[1]
    assert process.returncode == 130 and "Cancelled" in rest and "Traceback" not in rest
    assert blend.read_bytes() == before
