"""Kernels are kept in the extension's user folder, and compiled from when it is enabled."""

from pathlib import Path

import bpy

from ...addon.core import compiling
from ...addon.pipeline.warm_up import compiler


def register() -> None:
    """Say where kernels are kept, and begin to compile them; without a window a bake does."""
    compiling.keep_in(_folder())
    if not bpy.app.background:
        compiler.start()


def unregister() -> None:
    """Stop compiling."""
    compiler.stop()


def _folder() -> Path | None:
    try:
        return Path(bpy.utils.extension_path_user(compiling.PACKAGE, path="kernels"))
    except ValueError:  # it is no extension, but a checkout
        return None
