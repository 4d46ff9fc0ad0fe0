"""Lightmaps into Blender's data: UV maps, properties of objects, images."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import Advice
from ...settings.frames import Frames
from ...settings.lightmap import LightmapSettings
from .images import lightmap_image, load_lightmaps
from .layout import Layout
from .meshes import write_uv_map

IMAGE, UV_MAP, SCALE_OFFSET = "lightmap_image", "lightmap_uv_map", "lightmap_scale_offset"
"""Custom properties of objects: name of the image's file, name of the UV map, and (sx, sy, ox, oy): what the UV map
has at (u, v) is in the image at (sx u + ox, sy v + oy)."""

_MADE = "photon_bake_uv_map"
"""Custom property of meshes: name of the UV map that was made for lightmaps."""

_FORMERLY_MADE = "Lightmap"
"""Name of the UV map that earlier versions made, without that property."""

_NO_UNDO = (
    "The files of earlier lightmaps were written over: Undo brings back their UV maps, not their pixels, so bake "
    "again after it."
)


def write_lightmaps(
    layout: Layout,
    objects: "Sequence[bpy.types.Object | None]",
    paths: Mapping[int, Path],
    settings: LightmapSettings,
    frames: Frames | None = None,
) -> list[str]:
    """Write the layout's UV maps and places to meshes and objects, and load the images' files.

    Parameters
    ----------
    layout : Layout
    objects : sequence of bpy.types.Object or None
        The object of each place, with its mesh as it was before the bake; None where it takes no light.
    paths : dict of int to Path
        Files by image, of several frames those of the first. The objects of other images stay as they are.
    settings : LightmapSettings
    frames : Frames, optional
        That there are files of.

    Returns
    -------
    list of str
        Warnings.
    """
    taking = [(place, obj) for place, obj in zip(layout.places, objects, strict=True) if obj and place.image in paths]
    for name, mesh in {place.mesh_name: obj.data for place, obj in taking}.items():
        if name in layout.made:
            _write_made(mesh, layout.uv_map, layout.made[name])
    for place, obj in taking:
        if obj.is_editable:  # one that is linked keeps its own
            obj[IMAGE] = paths[place.image].name
            obj[UV_MAP] = layout.uv_map
            obj[SCALE_OFFSET] = place.scale_offset
    rewritten = any(lightmap_image(layout.names[image]) for image in paths)
    load_lightmaps(list(paths.values()), [layout.names[image] for image in paths], settings, frames)
    return _said_once() if rewritten and not bpy.app.background else []


def remove_made_uv_map(mesh: "bpy.types.Mesh", name: str) -> None:
    """Remove the UV map that a mesh's lightmap is on, if it was made for it; which others are active stays so."""
    if name not in {mesh.get(_MADE), _FORMERLY_MADE} or name not in mesh.uv_layers:
        return
    layers = mesh.uv_layers
    active = layers.active.name if layers.active else ""
    rendered = next((one.name for one in layers if one.active_render), "")
    layers.remove(layers[name])
    if active in layers:
        layers.active = layers[active]
    if rendered in layers:
        layers[rendered].active_render = True
    if _MADE in mesh:
        del mesh[_MADE]


def _write_made(mesh: "bpy.types.Mesh", name: str, uv: np.ndarray) -> None:
    """Set a UV map that is made for lightmaps, which takes the place of an earlier version's."""
    if any(obj.data == mesh and obj.get(UV_MAP) == _FORMERLY_MADE for obj in bpy.data.objects):
        remove_made_uv_map(mesh, _FORMERLY_MADE)
    write_uv_map(mesh, name, uv)
    mesh[_MADE] = name


_said: list[str] = []


def _said_once() -> list[str]:
    """What undo cannot do, the first time in a session."""
    if _said:
        return []
    _said.append(_NO_UNDO)
    return [Advice(_NO_UNDO)]
