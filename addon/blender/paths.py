"""Files beside the .blend file, and files of images."""

from pathlib import Path

import bpy


def from_blend_file(path: Path) -> str:
    """The path as seen from the saved file, if it lies in the same folder or below it."""
    beside = bpy.data.filepath and path.is_relative_to(Path(bpy.data.filepath).parent)
    return bpy.path.relpath(str(path)) if beside else str(path)


def path_of(image: "bpy.types.Image") -> Path:
    """Where an image of this file has its own."""
    return Path(bpy.path.abspath(image.filepath))
