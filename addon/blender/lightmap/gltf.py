"""glTF files whose TEXCOORD_1 is the lightmap's, for engines that ask for it there."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import addon_utils
import bpy
import numpy as np

from ...errors import BakeError
from ...output import atomic_path, check_writable
from ..temporary import Temporary
from ..visibility import objects_of
from .meshes import write_uv_map
from .writing import SCALE_OFFSET, UV_MAP

EXPORTER = "io_scene_gltf2"


def export_gltf(path: Path, selected_only: bool = False) -> list[str]:
    """Export the scene with two UV maps for each object that has a lightmap: its own, and the lightmap's.

    The second, TEXCOORD_1, has the object's scale and offset in it, so that it looks the image up as it is. Custom
    properties go along; `lightmap_image` names the image's file.

    Parameters
    ----------
    path : Path
        Ending in .glb, or in .gltf for a file beside which buffers and images lie.

    Returns
    -------
    list of str
        Names of the objects with lightmaps.

    Raises
    ------
    BakeError
        If no object has a lightmap, Blender's exporter is not there or says no.
    """
    objects = [obj for obj in objects_of(bpy.context.view_layer) if obj.type == "MESH" and _has_lightmap(obj)]
    if not objects:
        raise BakeError("No object in the view layer has a lightmap: bake lightmaps first.")
    if addon_utils.enable(EXPORTER, default_set=False) is None:
        raise BakeError("Blender's glTF exporter is not there: enable the add-on glTF 2.0 format.")
    check_writable(path)
    with _two_uv_maps(objects):
        try:
            if path.suffix.lower() == ".gltf":  # it names other files after itself
                _export(path, "GLTF_SEPARATE", selected_only)
            else:
                with atomic_path(path) as temporary:
                    _export(temporary, "GLB", selected_only)
        except RuntimeError as error:
            raise BakeError(f"{path} was not exported: {str(error).strip()}") from error
    return [obj.name for obj in objects]


def _export(path: Path, file_format: str, selected_only: bool) -> None:
    bpy.ops.export_scene.gltf(
        filepath=str(path),
        export_format=file_format,
        export_apply=True,
        export_extras=True,
        export_texcoords=True,
        use_selection=selected_only,
    )


def _has_lightmap(obj: "bpy.types.Object") -> bool:
    return SCALE_OFFSET in obj and obj.get(UV_MAP) in obj.data.uv_layers


@contextmanager
def _two_uv_maps(objects: "list[bpy.types.Object]") -> Iterator[None]:
    """Meanwhile the objects have copies of their meshes with these two UV maps alone."""
    own = {obj: obj.data for obj in objects}
    with Temporary() as temporary:
        try:
            for obj, mesh in own.items():
                obj.data = temporary.add(mesh.copy())
                obj.data.name = mesh.name
                _arrange(obj.data, obj[UV_MAP], np.array(obj[SCALE_OFFSET], np.float32))
            yield
        finally:
            for obj, mesh in own.items():
                obj.data = mesh


def _arrange(mesh: "bpy.types.Mesh", uv_map: str, scale_offset: np.ndarray) -> None:
    """Leave a mesh with the UV map that materials read and, second, the lightmap's in its place."""
    layers = mesh.uv_layers
    rendered = next((one.name for one in layers if one.active_render), "")
    maps = []
    for name in (rendered, uv_map):
        uv = np.empty((len(mesh.loops), 2), np.float32)
        layers[name].uv.foreach_get("vector", uv.reshape(-1))
        maps.append(uv)
    for name in [one.name for one in layers]:
        layers.remove(layers[name])
    write_uv_map(mesh, rendered if rendered != uv_map else "UVMap", maps[0])
    write_uv_map(mesh, uv_map, maps[1] * scale_offset[:2] + scale_offset[2:])
