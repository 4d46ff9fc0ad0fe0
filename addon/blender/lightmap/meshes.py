"""UV maps of Blender's meshes: read, written, and taken through modifiers; which meshes can have one."""

from collections.abc import Mapping

import bpy
import numpy as np

from ...core.errors import BakeError
from ...settings.lightmap import MADE_UV_MAP
from ..read.meshes.vertex_meshes import check_is_mesh, check_placed
from ..read.render_graph import in_render_graph
from ..temporary import Temporary
from ..write.color_attribute import check_editable

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
    check_placed(obj, depsgraph)


def through_modifiers(
    objects: "list[bpy.types.Object]", uv_of: Mapping[str, np.ndarray]
) -> "dict[bpy.types.Object, np.ndarray]":
    """Texture coordinates of the objects' evaluated corners, (c, 2) float32, where their modifiers bring them through.

    They are found on copies in a scene of their own.

    Parameters
    ----------
    uv_of : mapping
        The UV map of each stored mesh, (c, 2), by its name.
    """
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
            write_uv_map(mesh, MADE_UV_MAP, uv_of[obj.data.name])
            scene.collection.objects.link(copies[obj])

        def read(depsgraph: "bpy.types.Depsgraph") -> "dict[bpy.types.Object, np.ndarray]":
            found = {obj: read_uv_map(copy.evaluated_get(depsgraph).data, MADE_UV_MAP) for obj, copy in copies.items()}
            return {obj: uv for obj, uv in found.items() if uv is not None}

        return in_render_graph(scene, scene.view_layers[0], read)


def read_uv_map(mesh: "bpy.types.Mesh", name: str) -> np.ndarray | None:
    """Texture coordinates of a mesh's corners, (c, 2) float32, None without such a UV map."""
    layer = mesh.uv_layers.get(name)
    if layer is None:
        return None
    uv = np.empty((len(mesh.loops), 2), np.float32)
    layer.uv.foreach_get("vector", uv.reshape(-1))
    return uv


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
