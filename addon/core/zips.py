"""The zips that the extension comes in, and whether this Blender has got the right one."""

import importlib.util
import platform
import sys

from .errors import BakeError

BLENDER_OF_PYTHON = {"3.11": "4.5", "3.13": "5.2", "3.14": "5.2-debian"}
"""What a zip's name calls the Blender that it is for, by that Blender's Python."""


def this_platform() -> str:
    """Blender's name for the platform that this runs on."""
    system = {"darwin": "macos"}.get(platform.system().lower(), platform.system().lower())
    machine = {"x86_64": "x64", "amd64": "x64", "aarch64": "arm64"}.get(platform.machine().lower(), platform.machine())
    return f"{system}-{machine}"


def zip_name(python: str, platform_name: str, version: str = "<version>") -> str:
    """What the zip for a Python version, as in ``3.13``, and a platform is called."""
    return f"photon_bake-{version}-blender{BLENDER_OF_PYTHON[python]}-{platform_name}.zip"


def check_zip() -> None:
    """See whether the zip's wheels are there.

    Raises
    ------
    BakeError
        If SciPy is not, without which nothing is baked: one sentence that names the zip that has it.
    """
    if importlib.util.find_spec("scipy") is not None:
        return
    python, system = "{}.{}".format(*sys.version_info), this_platform()
    if python not in BLENDER_OF_PYTHON:
        raise BakeError(f"There is no Photon Bake for a Blender with Python {python}.")
    raise BakeError(f"This is not the zip for this Blender: remove it, and install {zip_name(python, system)}.")
