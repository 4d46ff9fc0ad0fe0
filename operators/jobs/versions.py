"""Versions of everything that has a say in the light."""

import importlib.metadata
import platform
import tomllib
from pathlib import Path

import bpy

_PACKAGES = ("numpy", "scipy", "embreex", "numba", "llvmlite", "OpenEXR", "pyoidn")


def versions() -> dict[str, str]:
    """Versions by name."""
    found = {"photon_bake": own_version(), "blender": bpy.app.version_string, "python": platform.python_version()}
    for package in _PACKAGES:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            found[package] = "not installed"
    return found


def own_version() -> str:
    """The extension's."""
    manifest = Path(__file__).parents[2] / "blender_manifest.toml"
    return str(tomllib.loads(manifest.read_text(encoding="utf-8"))["version"]) if manifest.is_file() else "unknown"
