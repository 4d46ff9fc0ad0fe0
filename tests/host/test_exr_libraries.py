"""OpenEXR's wheel beside the OpenEXR that Blender is linked to."""

import subprocess
import sys
import sysconfig
from pathlib import Path

import bpy
import numpy as np
import OpenEXR
import pytest

WRITE = """
import ctypes, os, sys
from pathlib import Path
for library in sys.argv[2:]:
    ctypes.CDLL(library, ctypes.RTLD_GLOBAL)  # before the wheel, as in a Blender that is linked to it
import numpy as np
from photon_bake.addon.output.exr import write_exr
ramp = np.arange(64 * 48, dtype=np.float32).reshape(48, 64)
for compression in ("none", "zip", "piz", "dwaa"):
    write_exr(Path(sys.argv[1]) / f"{compression}.exr", {"R": ramp}, half=False, compression=compression)
os.write(2, b"written")
"""


def red(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return file.channels()["R"].pixels


@pytest.mark.skipif(sys.platform != "linux" or not bpy.app.module, reason="only there do the two versions mix")
def test_nothing_is_printed_and_the_pixels_are_the_same(tmp_path):
    library = next(Path(sysconfig.get_paths()["purelib"]).glob("bpy/lib/libOpenEXRCore.so.*"))
    for folder, libraries in (("alone", []), ("beside", [library])):
        (tmp_path / folder).mkdir()
        command = [sys.executable, "-c", WRITE, tmp_path / folder, *libraries]
        done = subprocess.run(command, capture_output=True, text=True)
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "written")
    for path in (tmp_path / "alone").iterdir():
        assert np.array_equal(red(path), red(tmp_path / "beside" / path.name))
