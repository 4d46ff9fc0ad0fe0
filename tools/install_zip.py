"""Make a Blender ready for Photon Bake, in a folder of its own that leaves the user's settings alone.

    python tools/install_zip.py BLENDER             builds the zip for this Blender, installs and enables it
    python tools/install_zip.py BLENDER --tests     instead lays out what tests/host needs in it: pytest and the wheels

Prints the folder, which is to be BLENDER_USER_RESOURCES; what it does meanwhile goes to stderr. Nothing is done twice.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import build_zip
from photon_bake.addon.core.zips import this_platform

ASK = "import bpy, sys; print('ANSWER %d.%d.%d %d.%d' % (*bpy.app.version, *sys.version_info[:2]))"
TEST_REQUIREMENTS = ("pytest>=8", "hypothesis>=6.100")


def blender(executable: str, *arguments: str, resources: Path) -> str:
    """Run Blender in the background with its user folder elsewhere, which goes if it fails; returns what it printed."""
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(resources)}
    command = [executable, "-b", *arguments]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if run.returncode:
        shutil.rmtree(resources, ignore_errors=True)
        raise SystemExit(f"{' '.join(command)} failed with status {run.returncode}:\n{run.stdout}{run.stderr}")
    return run.stdout


def versions(executable: str) -> tuple[str, str]:
    """Blender's version and its Python's, as in ``("5.2.0", "3.13")``."""
    with tempfile.TemporaryDirectory() as folder:
        said = blender(executable, "--factory-startup", "--python-expr", ASK, resources=Path(folder))
    answer = re.search(r"^ANSWER (\S+) (\S+)$", said, re.MULTILINE)
    if not answer:
        raise SystemExit(f"{executable} does not answer like a Blender:\n{said}")
    if tuple(map(int, answer[1].split("."))) < (4, 5):
        raise SystemExit(f"{executable} is Blender {answer[1]}; Photon Bake needs 4.5 or newer.")
    return answer[1], answer[2]


def install(executable: str, version: str, target: build_zip.Target, resources: Path) -> None:
    """Install the zip into `resources` and enable it, unless this very zip is there."""
    path = build_zip.build(target, this_platform())
    stamp = resources / "installed"
    wanted = f"{version} {build_zip.digest(path)}"
    if stamp.exists() and stamp.read_text() == wanted:
        return
    build_zip.say(f"Installing {path.name} for Blender {version}")
    shutil.rmtree(resources, ignore_errors=True)
    resources.mkdir(parents=True)
    blender(
        executable,
        *("--command", "extension", "install-file", "--repo=user_default", "--enable", str(path)),
        resources=resources,
    )
    if not (resources / "extensions" / "user_default" / "photon_bake").is_dir():
        raise SystemExit(f"Blender {version} did not install {path.name}.")
    stamp.write_text(wanted)


def lay_out_tests(version: str, target: build_zip.Target, resources: Path) -> None:
    """Put pytest and the zip's wheels where Blender's Python imports them.

    The extension is not installed: the tests register the checkout, and one name cannot be registered twice.
    """
    wheels = build_zip.wheels(target, this_platform())
    stamp = resources / "laid_out"
    wanted = " ".join([version, *TEST_REQUIREMENTS, *(wheel.name for wheel in wheels)])
    if stamp.exists() and stamp.read_text() == wanted:
        return
    build_zip.say(f"Laying out pytest and the wheels for Blender {version}, Python {target.python}")
    shutil.rmtree(resources, ignore_errors=True)
    modules = resources / "scripts" / "addons" / "modules"
    modules.mkdir(parents=True)
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", f"--target={modules}"]
    pip += build_zip.pip_selection(target, this_platform())
    subprocess.run([*pip, *TEST_REQUIREMENTS], check=True, stdout=sys.stderr)
    for wheel in wheels:
        with zipfile.ZipFile(wheel) as archive:
            archive.extractall(modules)  # all that Blender does with a wheel
    stamp.write_text(wanted)


def main() -> None:
    parser = argparse.ArgumentParser(description="Make a Blender ready for Photon Bake, in a folder of its own.")
    parser.add_argument("blender", help="the Blender executable")
    parser.add_argument("--tests", action="store_true", help="what tests/host needs, instead of the extension")
    parser.add_argument("--folder", type=Path, default=build_zip.ROOT / "build" / "blender", help="where folders go")
    options = parser.parse_args()
    version, python = versions(options.blender)
    target = build_zip.target_for(python)
    resources = options.folder.resolve() / f"{version}-python{python}{'-tests' if options.tests else ''}"
    if options.tests:
        lay_out_tests(version, target, resources)
    else:
        install(options.blender, version, target, resources)
    print(resources)


if __name__ == "__main__":
    main()
