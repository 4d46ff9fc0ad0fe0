"""Measures how alike EEVEE and Cycles show baked light, in the Blender with a window that BLENDER names.

    make bench ARGS="--only eevee" BLENDER=/path/to/blender

Needs Xvfb; without it or BLENDER there is no table.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from figures import ROOT, table


def tables(_, options):
    blender = os.environ.get("BLENDER")
    if not blender or not shutil.which("xvfb-run"):
        print("EEVEE is left out: it needs BLENDER and xvfb-run.")
        return []
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.pictures or Path(temporary)
        said = in_window(blender, ROOT / "tests/bench/eevee_window.py", folder.absolute())
    found = json.loads(next(line for line in said.splitlines() if line.startswith("eevee: ")).removeprefix("eevee: "))
    forty = [[engine, *map("{:.3f}".format, spread(shown))] for engine, shown in found["forty"].items()]
    demo = [[name, *map("{:.3f}".format, color)] for name, color in found["demo"].items()]
    head = ["Engine", "Least", "Mean", "Most"]
    return [
        table("40 objects with a lightmap each, one material: light shown over light in the image", head, forty),
        table("The demo with a draft's light, mean color", ["", "Red", "Green", "Blue"], demo),
    ]


def spread(values):
    """The least of values, their mean and the most."""
    return np.min(values), np.mean(values), np.max(values)


def in_window(blender, script, *arguments):
    """What a script prints in a Blender on a screen of its own."""
    lay_out = [sys.executable, ROOT / "tools/install_zip.py", "--tests", blender]
    resources = subprocess.run(lay_out, check=True, stdout=subprocess.PIPE, text=True).stdout.strip()
    command = ["xvfb-run", "-a", "-s", "-screen 0 1600x1000x24", blender, "--factory-startup", "--gpu-backend"]
    command += ["opengl", "--python", str(script), "--", *map(str, arguments)]
    surroundings = {**os.environ, "BLENDER_USER_RESOURCES": resources, "LIBGL_ALWAYS_SOFTWARE": "1"}
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=surroundings, timeout=900).stdout
