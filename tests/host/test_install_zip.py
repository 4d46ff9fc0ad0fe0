"""The zip, installed into an empty Blender whose Python has none of the wheels, bakes."""

import importlib.util
import os
import platform
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import bpy
import pytest
from photon_bake.addon.core.zips import this_platform

ROOT = Path(__file__).resolve().parents[2]

pytestmark = pytest.mark.skipif(
    Path(bpy.app.binary_path).is_file(), reason="installs into the bpy module; make bake BLENDER=… does so in a Blender"
)

# Without the module's own end, which hangs in version 4.5 where an extension had been enabled.
LEAVE = """
import os
sys.stdout.flush()
os._exit(0)
"""

INSTALL = (
    """
import importlib.util, sys
site, zip_path = sys.argv[1:]
sys.path.append(site)
for name in ("embreex", "llvmlite", "numba", "scipy", "OpenEXR", "photon_bake"):
    assert importlib.util.find_spec(name) is None, f"{name} is there before the zip is installed"

import bpy
bpy.ops.wm.read_userpref()
assert not bpy.context.preferences.addons.get("bl_ext.user_default.photon_bake")
bpy.ops.extensions.package_install_files(filepath=zip_path, repo="user_default", enable_on_install=True)
assert bpy.context.preferences.addons.get("bl_ext.user_default.photon_bake"), "the extension is not enabled"
bpy.ops.wm.save_userpref()
"""
    + LEAVE
)

BAKE = (
    """
import os, sys
site, _ = sys.argv[1:]
sys.path.append(site)

import bpy
bpy.ops.wm.read_userpref()
import embreex, llvmlite, numba, scipy, OpenEXR
for module in (embreex, llvmlite, numba, scipy, OpenEXR):
    assert module.__file__.startswith(os.environ["BLENDER_USER_RESOURCES"]), module.__file__

bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
bpy.ops.mesh.primitive_cube_add(size=4)
bpy.ops.object.light_add(type="POINT", location=(0, 0, 1))
bpy.context.object.data.energy = 100
room = bpy.data.objects["Cube"]
room.data.flip_normals()  # its inside is what is seen
bpy.context.view_layer.objects.active = room
room.select_set(True)
assert bpy.ops.photon_bake.bake_indirect() == {"FINISHED"}

import numpy
attribute = room.data.attributes["Indirect"]
colors = numpy.empty(4 * len(attribute.data), numpy.float32)
attribute.data.foreach_get("color", colors)
colors = colors.reshape(-1, 4)[:, :3]
assert numpy.isfinite(colors).all() and (colors > 0.01).all(), colors
print("BAKED", colors.mean())
"""
    + LEAVE
)


def tool(name):
    """A file of tools/ as a module."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "tools" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # where a dataclass looks itself up, and the other tools too
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def zip_path():
    """The zip for this Python and platform."""
    build_zip = tool("build_zip")
    python = ".".join(platform.python_version_tuple()[:2])
    return build_zip.build(build_zip.target_for(python), this_platform())


@pytest.fixture
def bare_python(tmp_path):
    """Run code in this Python with an empty Blender user folder and without the wheels and the checkout."""
    site = tmp_path / "site"
    site.mkdir()
    for path in Path(sysconfig.get_paths()["purelib"]).iterdir():
        if not path.name.startswith(("embreex", "llvmlite", "numba", "scipy", "OpenEXR", "openexr", "photon_bake")):
            (site / path.name).symlink_to(path)
    # In one place: Numba finds compiled kernels again by the path of their sources.
    resources = ROOT / "build" / "installed"
    shutil.rmtree(resources, ignore_errors=True)
    resources.mkdir(parents=True)

    def run(code, *arguments):
        command = [sys.executable, "-I", "-S", "-c", code, str(site), *map(str, arguments)]
        environment = {**os.environ, "BLENDER_USER_RESOURCES": str(resources)}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=600)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run


@pytest.mark.long
def test_an_installed_zip_bakes(bare_python, zip_path):
    bare_python(INSTALL, zip_path)
    assert "BAKED" in bare_python(BAKE, zip_path)


def test_a_zip_holds_the_extension_and_its_wheels_only(zip_path):
    import zipfile

    names = zipfile.ZipFile(zip_path).namelist()
    assert sorted(names) == names
    tops = {name.partition("/")[0] for name in names}
    assert {"__init__.py", "LICENSE", "addon", "blender_manifest.toml", "operators", "wheels"} <= tops
    assert tops <= {"__init__.py", "LICENSE", "README.md", "CHANGELOG.md"} | {
        "addon", "blender_manifest.toml", "docs", "operators", "shaders", "wheels"
    }  # fmt: skip
    wheels = [name for name in names if name.startswith("wheels/")]
    packages = {name.split("/")[1].split("-")[0] for name in wheels}
    assert packages == {"embreex", "llvmlite", "numba", "openexr", "scipy"}


@pytest.mark.skipif(os.name == "nt", reason="the Blender is a shell script")
def test_a_blender_that_refuses_the_zip_leaves_no_folder(tmp_path, monkeypatch):
    """Blender unpacks a zip that is for another Python before it says so."""
    build_zip, install_zip = tool("build_zip"), tool("install_zip")
    monkeypatch.setattr(build_zip, "build", lambda target, platform_name: ROOT / "README.md")
    blender = tmp_path / "blender"
    blender.write_text(
        '#!/bin/sh\nmkdir -p "$BLENDER_USER_RESOURCES/extensions/photon_bake"; echo incompatible; exit 1'
    )
    blender.chmod(0o755)
    with pytest.raises(SystemExit, match=r"README\.md failed with status 1:\nincompatible"):
        install_zip.install(str(blender), "5.2.0", build_zip.target_for("3.13"), tmp_path / "resources")
    assert not (tmp_path / "resources").exists()
