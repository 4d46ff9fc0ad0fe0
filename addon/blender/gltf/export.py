"""The scene as a glTF file, by Blender's exporter, which is shown meshes that have baked light in engines' terms."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from shutil import copyfile

import addon_utils
import bpy
import numpy as np

from ...core.errors import BakeError
from ...output import atomic_path, check_writable
from ..lightmap.images import lightmaps_by_file
from ..lightmap.meshes import write_uv_map
from ..lightmap.writing import IMAGE, SCALE_OFFSET, UV_MAP
from ..paths import path_of
from ..read.lamps.light_layers import with_groups
from ..read.meshes.meshes import UVMaps
from ..read.visibility import objects_of
from ..temporary import Temporary

EXPORTER = "io_scene_gltf2"

LIGHT_ATTRIBUTE = "light_attribute"
"""Custom property of exported meshes: name of the attribute that holds the light of their vertices, E/π."""


@dataclass
class Exported:
    """What was exported.

    Attributes
    ----------
    lightmaps, vertices : list of str
        Names of the objects with light in lightmaps, and of those with light on vertices.
    images : list of Path
        Lightmaps that lie beside the file.
    missing : list of str
        Names of files of lightmaps that are not to be found.
    """

    lightmaps: list[str] = field(default_factory=list)
    vertices: list[str] = field(default_factory=list)
    images: list[Path] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)


def export_gltf(
    path: Path, attribute: str, selected_only: bool = False, lights: bool = True, cameras: bool = False
) -> Exported:
    """Export what renders show, with the light of objects that have some.

    - Of an object with a lightmap TEXCOORD_0 is the UV map that its materials read, and TEXCOORD_1 the lightmap's with
      the object's scale and offset in it, so that it looks the image up as it is. The image is copied to the file's
      folder; the object's custom property `lightmap_image`, which goes along, is its name.
    - Of a mesh with light on vertices, that is a custom attribute, whose name the mesh's property `light_attribute`
      tells, and no vertex color: engines would multiply base colors by it. Light groups baked apart have their own.
    - Lamps have watts per steradian and square metre, as lightmaps have, and not lumens.

    Parameters
    ----------
    path : Path
        Ending in .glb, or in .gltf for a file beside which buffers and images lie.
    attribute : str
        Color attribute with light.

    Raises
    ------
    BakeError
        If no object has light, Blender's exporter is not there or says no.
    """
    objects = [obj for obj in objects_of(bpy.context.view_layer) if obj.type == "MESH" and obj.is_editable]
    mapped = [obj for obj in objects if _has_lightmap(obj)]
    lit = [obj for obj in objects if attribute in obj.data.color_attributes]
    if not mapped and not lit:
        raise BakeError("No object in the view layer has baked light: bake lightmaps or vertices first.")
    if addon_utils.enable(EXPORTER, default_set=False) is None:
        raise BakeError("Blender's glTF exporter is not there: enable the add-on glTF 2.0 format.")
    check_writable(path)
    options = {"use_selection": selected_only, "export_lights": lights, "export_cameras": cameras}
    with _in_engines_terms(mapped, lit, attribute):
        try:
            if path.suffix.lower() == ".gltf":  # it names other files after itself
                _export(path, "GLTF_SEPARATE", options)
            else:
                with atomic_path(path) as temporary:
                    _export(temporary, "GLB", options)
        except RuntimeError as error:
            raise BakeError(f"{path} was not exported: {str(error).strip()}") from error
    exported = Exported([obj.name for obj in mapped], [obj.name for obj in lit])
    images = lightmaps_by_file()
    for name in dict.fromkeys(obj[key] for obj in mapped for key in with_groups(IMAGE, obj.keys())):
        _put_beside(name, images.get(name), path.parent, exported)
    return exported


def exported_name(attribute: str) -> str:
    """What a color attribute is called in glTF: custom attributes begin with an underscore, and are in capitals."""
    return "_" + "".join(sign if sign.isascii() and sign.isalnum() else "_" for sign in attribute).upper()


def _export(path: Path, file_format: str, options: dict[str, bool]) -> None:
    bpy.ops.export_scene.gltf(
        filepath=str(path),
        export_format=file_format,
        export_apply=True,
        export_extras=True,
        export_texcoords=True,
        export_attributes=True,
        export_active_vertex_color_when_no_material=False,
        export_import_convert_lighting_mode="COMPAT",
        use_renderable=True,
        **options,
    )


def _has_lightmap(obj: "bpy.types.Object") -> bool:
    return IMAGE in obj and SCALE_OFFSET in obj and obj.get(UV_MAP) in obj.data.uv_layers


def _put_beside(name: str, image: "bpy.types.Image | None", folder: Path, exported: Exported) -> None:
    """Copy a lightmap's file to a folder, unless it is there."""
    source = path_of(image) if image else folder / name
    if not source.is_file():
        exported.missing.append(name)
        return
    with suppress(FileNotFoundError):
        if (folder / name).samefile(source):
            exported.images.append(folder / name)
            return
    with atomic_path(folder / name) as temporary:
        copyfile(source, temporary)
    exported.images.append(folder / name)


@contextmanager
def _in_engines_terms(
    mapped: "list[bpy.types.Object]", lit: "list[bpy.types.Object]", attribute: str
) -> Iterator[None]:
    """Meanwhile the objects have copies of their meshes, with light as the exporter is to find it."""
    own = {obj: obj.data for obj in dict.fromkeys([*mapped, *lit])}
    with Temporary() as temporary:
        try:
            for obj, mesh in own.items():
                obj.data = temporary.add(mesh.copy())
                obj.data.name = mesh.name
                if obj in lit:
                    for name in with_groups(attribute, obj.data.color_attributes.keys()):
                        _as_custom_attribute(obj.data, name)
                    obj.data[LIGHT_ATTRIBUTE] = exported_name(attribute)
                if obj in mapped:
                    _arrange(obj.data, obj[UV_MAP], np.array(obj[SCALE_OFFSET], np.float32))
            yield
        finally:
            for obj, mesh in own.items():
                obj.data = mesh


def _as_custom_attribute(mesh: "bpy.types.Mesh", attribute: str) -> None:
    """Turn a mesh's color attribute with light into one of vectors, which the exporter takes for no color."""
    light = mesh.color_attributes[attribute]
    name, domain, n = exported_name(attribute), light.domain, len(light.data)
    values = np.empty((n, 4), np.float32)
    light.data.foreach_get("color", values.reshape(-1))
    mesh.color_attributes.remove(light)
    stale = mesh.attributes.get(name)
    if stale is not None:
        mesh.attributes.remove(stale)
    vectors = mesh.attributes.new(name, "FLOAT_VECTOR", domain)
    vectors.data.foreach_set("vector", np.ascontiguousarray(values[:, :3]).reshape(-1))


def _arrange(mesh: "bpy.types.Mesh", uv_map: str, scale_offset: np.ndarray) -> None:
    """Leave a mesh with the UV map that materials read and, second, the lightmap's in its place."""
    layers = mesh.uv_layers
    rendered = next((one.name for one in layers if one.active_render), "")
    maps = [UVMaps(mesh).corners(name) for name in (rendered, uv_map)]
    for name in [one.name for one in layers]:
        layers.remove(layers[name])
    write_uv_map(mesh, rendered if rendered != uv_map else "UVMap", maps[0])
    write_uv_map(mesh, uv_map, maps[1] * scale_offset[:2] + scale_offset[2:])
