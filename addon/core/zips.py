"""The zips that the extension comes in, and whether this Blender has got the right one."""

import importlib
import importlib.util
import platform
import sys

from .errors import BakeError

BLENDER_OF_PYTHON = {"3.11": "4.5", "3.13": "5.2", "3.14": "5.2-debian"}
"""What a zip's name calls the Blender that it is for, by that Blender's Python."""

PLATFORMS = ("linux-x64", "windows-x64", "macos-arm64")
"""Blender's names of the platforms that there are zips for."""

LACKING = {"macos-x64": "Numba 0.63 or newer", "windows-arm64": "embreex", "linux-arm64": "embreex"}
"""Other platforms that Blender runs on, and what has no wheels for them."""

LIBRARIES = {"scipy": "scipy", "embreex": "embreex.rtcore_scene", "llvmlite": "llvmlite.binding", "numba": "numba"}
"""Libraries that every bake needs, and what of them is imported first."""


def this_platform() -> str:
    """Blender's name for the platform that this runs on."""
    system = {"darwin": "macos"}.get(platform.system().lower(), platform.system().lower())
    machine = {"x86_64": "x64", "amd64": "x64", "aarch64": "arm64"}.get(platform.machine().lower(), platform.machine())
    return f"{system}-{machine}"


def zip_name(python: str, platform_name: str, version: str = "<version>") -> str:
    """What the zip for a Python version, as in ``3.13``, and a platform is called."""
    return f"photon_bake-{version}-blender{BLENDER_OF_PYTHON[python]}-{platform_name}.zip"


def remedy() -> str:
    """What to do where this Blender has not got the libraries that the zip for it brings."""
    python, system = "{}.{}".format(*sys.version_info), this_platform()
    if system not in PLATFORMS:
        lacking = LACKING.get(system, "embreex")
        return f"there is no {lacking} for {system}; Photon Bake runs on {', '.join(PLATFORMS)}."
    if python not in BLENDER_OF_PYTHON:
        return f"there is no Photon Bake for a Blender with Python {python}."
    return f"remove Photon Bake, restart Blender, and install {zip_name(python, system)}."


def check_zip() -> None:
    """See whether the zip's wheels are there.

    Raises
    ------
    BakeError
        If SciPy is not, without which nothing is baked: one sentence that names the zip that has it.
    """
    if importlib.util.find_spec("scipy") is None:
        raise BakeError(f"This is not the zip for this Blender: {remedy()}")


def missing_library() -> str:
    """A sentence on the first of the zip's libraries that is not there; empty if all are. It imports none."""
    for name in LIBRARIES:
        if name not in sys.modules and importlib.util.find_spec(name) is None:
            return unusable_library(name, "it is not installed")
    return ""


def check_libraries() -> None:
    """Import the libraries that every bake needs, which takes half a second.

    Raises
    ------
    BakeError
        If one cannot be imported: one sentence with the reason and the remedy.
    """
    for name, module in LIBRARIES.items():
        try:
            importlib.import_module(module)
        except Exception as error:  # OSError of a library that does not load, ImportError of a wrong NumPy, and so on
            reason = (str(error).strip().splitlines() or [type(error).__name__])[0].rstrip(".")
            raise BakeError(unusable_library(name, reason)) from error


def unusable_library(name: str, reason: str) -> str:
    """A sentence on a library that cannot be imported for a reason."""
    return f"{name}, which every bake needs, cannot be imported ({reason}): {remedy()}"
