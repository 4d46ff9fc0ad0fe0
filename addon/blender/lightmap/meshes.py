"""Bake targets as `LightmapMesh`: evaluated triangles with their places in the lightmaps."""

import bpy
import numpy as np

from ...errors import BakeError
from ...lightmap_settings import MADE_UV_MAP
from ...progress import Progress
from ...receivers import LightmapMesh
from ..color_attribute import check_editable
from ..meshes import attribute, evaluated_mesh, read_mesh
from ..render_graph import in_render_graph
from ..temporary import Temporary
from ..transforms import place_normals, to_world
from ..vertex_meshes import check_is_mesh, check_shape
from .layout import Layout

MAX_UV_MAPS = 8


def check_lightmap_object(obj: "bpy.types.Object", depsgraph: "bpy.types.Depsgraph", uv_map: str = "") -> None:
    """Make sure that an object can have a lightmap.

    Parameters
    ----------
    uv_map : str
        The chosen UV map; empty where one is to be made, which changes the mesh.

    Raises
    ------
    BakeError
        If not, naming the object and what to do.
    """
    check_is_mesh(obj)
    if not uv_map:
        check_editable(obj)
        layers = obj.data.uv_layers
        if len(layers) >= MAX_UV_MAPS and MADE_UV_MAP not in layers:
            raise BakeError(
                f"Object '{obj.name}' has {len(layers)} UV maps, the most that a mesh can have: remove one, or choose "
                "one of them."
            )
    check_shape(obj, depsgraph)


def lightmap_meshes(
    objects: "list[bpy.types.Object]",
    depsgraph: "bpy.types.Depsgraph",
    layout: Layout,
    progress: Progress | None = None,
) -> list[LightmapMesh]:
    """The triangles of objects, as modifiers make them, in their lightmaps.

    Raises
    ------
    BakeError
        If modifiers leave no UV map.
    """
    evaluated = {obj: evaluated_mesh(obj.evaluated_get(depsgraph), depsgraph) for obj in objects}
    changed = [obj for obj in objects if layout.made and not _same_corners(obj.data, evaluated[obj])]
    uvs = _through_modifiers(changed, layout)
    meshes = []
    for obj, place in zip(objects, layout.places, strict=True):
        if progress is not None:
            progress.check()
        mesh = read_mesh(evaluated[obj])
        if obj in uvs:
            uv = uvs[obj]
        elif layout.made:
            uv = layout.made[obj.data.name]
        else:
            uv = _read(obj, evaluated[obj], layout.uv_map)
        matrix = np.array(obj.evaluated_get(depsgraph).matrix_world, np.float64)
        scale, offset = np.array(place.scale_offset, np.float32).reshape(2, 2)
        meshes.append(
            LightmapMesh(
                object_name=obj.name,
                image=place.image,
                positions=to_world(mesh.vertices, matrix, obj.name)[mesh.triangles],
                normals=place_normals(mesh.normals, matrix)[mesh.normal_of_corner],
                uv=uv[mesh.corners] * scale + offset,
            )
        )
    return meshes


def _same_corners(mesh: "bpy.types.Mesh", evaluated: "bpy.types.Mesh") -> bool:
    """Whether modifiers leave the faces' corners alone, or only give them new vertices."""
    if len(mesh.loops) != len(evaluated.loops) or len(mesh.polygons) != len(evaluated.polygons):
        return False
    before, after = (attribute(one, ".corner_vert", "value", (len(one.loops),), np.int32) for one in (mesh, evaluated))
    return np.array_equal(before, after)


def _read(obj: "bpy.types.Object", evaluated: "bpy.types.Mesh", name: str) -> np.ndarray:
    """Texture coordinates of an evaluated mesh's corners, (c, 2) float32."""
    layer = evaluated.uv_layers.get(name)
    if layer is None:
        shown = ", ".join(f"'{modifier.name}'" for modifier in obj.modifiers)
        raise BakeError(
            f"Object '{obj.name}' loses its UV map '{name}' to its modifiers ({shown}): apply them, or disable them."
        )
    uv = np.empty((len(evaluated.loops), 2), np.float32)
    layer.uv.foreach_get("vector", uv.reshape(-1))
    return uv


def _through_modifiers(objects: "list[bpy.types.Object]", layout: Layout) -> "dict[bpy.types.Object, np.ndarray]":
    """What modifiers make of the objects' new UV maps, found on copies in a scene of their own."""
    if not objects:
        return {}
    with Temporary() as temporary:
        scene = temporary.add(bpy.data.scenes.new("Photon Bake"))
        scene.frame_current, scene.frame_subframe = bpy.context.scene.frame_current, bpy.context.scene.frame_subframe
        copies = {}
        for obj in objects:
            mesh = temporary.add(obj.data.copy())
            copies[obj] = temporary.add(obj.copy())
            copies[obj].data = mesh
            write_uv_map(mesh, layout.uv_map, layout.made[obj.data.name])
            scene.collection.objects.link(copies[obj])

        def read(depsgraph: "bpy.types.Depsgraph") -> "dict[bpy.types.Object, np.ndarray]":
            return {obj: _read(obj, copy.evaluated_get(depsgraph).data, layout.uv_map) for obj, copy in copies.items()}

        return in_render_graph(scene, scene.view_layers[0], read)


def write_uv_map(mesh: "bpy.types.Mesh", name: str, uv: np.ndarray) -> None:
    """Set a UV map of an original mesh from the corners' coordinates (c, 2), or add it; which is active stays so."""
    layers = mesh.uv_layers
    active, rendered = layers.active_index, next((i for i, one in enumerate(layers) if one.active_render), None)
    layer = layers.get(name) or layers.new(name=name, do_init=False)
    layer.uv.foreach_set("vector", np.ascontiguousarray(uv, np.float32).reshape(-1))
    if rendered is not None:
        layers.active_index = active
        layers[rendered].active_render = True
    mesh.update()
