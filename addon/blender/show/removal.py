"""Lightmaps taken out of a file: images, UV maps that were made, custom properties, and the images' files if asked."""

from pathlib import Path

import bpy

from ..lightmap.images import OF
from ..lightmap.writing import IMAGE, SCALE_OFFSET, UV_MAP, remove_made_uv_map
from ..paths import path_of
from ..read.lamps.light_layers import with_groups


def remove_lightmaps(files: bool = False) -> tuple[int, list[str]]:
    """Remove all lightmaps that are not shown (see `leave_baked_light`).

    Parameters
    ----------
    files : bool
        Whether to delete the images' files too, and their folder if nothing else is in it.

    Returns
    -------
    int
        How many images there were.
    list of str
        Sentences about files that could not be deleted.
    """
    images = [image for image in bpy.data.images if OF in image]
    paths = [path_of(image) for image in images if image.filepath]
    for obj in bpy.data.objects:
        if UV_MAP in obj and obj.is_editable:
            if obj.type == "MESH" and obj.data.is_editable:
                remove_made_uv_map(obj.data, obj[UV_MAP])
            for name in (*with_groups(IMAGE, obj.keys()), UV_MAP, SCALE_OFFSET):
                obj.pop(name, None)
    bpy.data.batch_remove(images)
    return len(images), _delete(paths) if files else []


def _delete(paths: list[Path]) -> list[str]:
    """Delete files, and those of directional light beside them."""
    from ...output.lightmap import KINDS  # here, as Blender's start should not wait for SciPy

    failures = []
    for path in paths:
        stem, _, kind = path.stem.rpartition("_")
        there = [path, *(one for one in path.parent.glob("*") if one.stem in {f"{stem}_{k}" for k in KINDS})]
        for one in there if kind else [path]:
            try:
                one.unlink(missing_ok=True)
            except OSError as error:
                failures.append(f"{one} could not be deleted ({error.strerror}).")
    for folder in {path.parent for path in paths}:
        if folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()
    return failures
