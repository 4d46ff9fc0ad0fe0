"""Volume objects as media: their grids as Geometry Nodes sample them, and by those the nodes of their materials."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import ceil

import bpy
import numpy as np

from ....scene import Medium
from ...temporary import Temporary
from ...warn import Warnings
from ..materials.expressions import Evaluator, UnreadableError, no_images
from ..materials.nodes import Place
from .volume_shaders import VolumeShader, volume_differences, volume_shortcomings

MOST_CELLS = 1 << 22
"""Of one volume object: of finer grids some voxels share a cell."""

_OUTPUTS = {"Density": "density", "Flame": "flame", "Temperature": "temperature"}
"""Of a Volume Info node, and the grids that they are."""


def read_clouds(
    placed: "list[tuple[bpy.types.Object, np.ndarray]]", depsgraph: "bpy.types.Depsgraph", warnings: Warnings
) -> tuple[Medium, ...]:
    """The media of volume objects.

    Parameters
    ----------
    placed : list of (bpy.types.Object, (4, 4) float64)
        Originals, and instances' matrices, local to world.
    depsgraph : bpy.types.Depsgraph
    warnings : Warnings
    """
    found = []
    shaders: dict[bpy.types.Object, VolumeShader | None] = {}
    for obj, matrix in placed:
        if obj not in shaders:
            shaders[obj] = _shader_of(obj, depsgraph, warnings)
        shader = shaders[obj]
        if shader is not None and np.isfinite(matrix).all() and abs(np.linalg.det(matrix)) > 1e-30:
            medium = _cloud(obj.evaluated_get(depsgraph), matrix, shader, warnings)
            if medium is not None:
                found.append(medium)
    return tuple(found)


def _shader_of(obj: "bpy.types.Object", depsgraph: "bpy.types.Depsgraph", warnings: Warnings) -> VolumeShader | None:
    """What a volume object is filled with; Cycles shows none that has no material."""
    slots = obj.evaluated_get(depsgraph).material_slots
    material = depsgraph.view_layer.material_override or (slots[0].material if slots else None)
    if material is None:
        return None
    for what in (*volume_shortcomings(material), *volume_differences(material)):
        warnings.add(f"Material '{material.name}': {what}.")
    return VolumeShader.of(material)


def _cloud(obj: "bpy.types.Object", matrix: np.ndarray, shader: VolumeShader, warnings: Warnings) -> Medium | None:
    """The medium of one instance of an evaluated volume object."""
    grids = {grid.name: grid for grid in obj.data.grids if grid.data_type == "FLOAT"}
    names = sorted(set(shader.grids) & set(grids)) or sorted(grids)[:1]
    if not names:
        return None
    local_from_index = np.array(grids[names[0]].matrix_object, np.float64)
    shape, local_from_grid, share = _lattice(np.array(obj.bound_box), local_from_index)
    if share > 1:
        warnings.add(f"Volume '{obj.name}' has many voxels: it is baked in cells of {share} × {share} × {share}.")
    middles = (np.indices(shape).reshape(3, -1).T + 0.5) @ local_from_grid[:3, :3].T + local_from_grid[:3, 3]
    voxels = {name: _sampled(obj.original, name, middles) for name in names}
    return medium_of_grids(shader, obj.name, voxels, shape, matrix @ local_from_grid, warnings)


def medium_of_grids(
    shader: VolumeShader,
    name: str,
    voxels: dict[str, np.ndarray],
    shape: tuple[int, int, int],
    world_from_grid: np.ndarray,
    warnings: Warnings,
) -> Medium | None:
    """The medium by the grids (n,) of an object of some name, in the cells of a lattice, in C order."""
    material = f"Material '{shader.block.name}'"
    try:
        values = shader.at_voxels(_VoxelEvaluator(no_images, voxels=voxels).value, voxels)
    except UnreadableError as error:
        warnings.add(f"{material}: its volume is not baked on '{name}', as its {error} is not of the grids.")
        return None
    medium, is_exact = shader.medium_in(values, shape, np.linalg.inv(world_from_grid)[:3])
    if not is_exact:
        warnings.add(f"{material}: the color of its volume differs from place to place, and its mean is baked.")
    return medium


@dataclass
class _VoxelEvaluator(Evaluator):
    """Evaluates sockets where nodes read grids (n,), as (n, 1, 1 or 3) pictures."""

    voxels: dict[str, np.ndarray] = field(default_factory=dict)

    def _computed(self, place: Place) -> np.ndarray:
        node, name = place.socket.node, ""
        if node.type == "VOLUME_INFO":
            name = _OUTPUTS.get(place.socket.identifier, "")
        elif node.type == "ATTRIBUTE" and node.attribute_type == "GEOMETRY":
            name = node.attribute_name
        else:
            return super()._computed(place)
        value = self.voxels.get(name, np.zeros(1, np.float32))
        return value.reshape(-1, 1, 1)


def _lattice(bounds: np.ndarray, local_from_index: np.ndarray) -> tuple[tuple[int, int, int], np.ndarray, int]:
    """Cells of one or more voxels over the bounds (8, 3) of a grid and one voxel more: their number along each axis,
    the (4, 4) matrix from their frame to the object's, and how many voxels each is wide.
    """
    index_from_local = np.linalg.inv(local_from_index)
    index = bounds @ index_from_local[:3, :3].T + index_from_local[:3, 3]
    low, high = np.floor(index.min(axis=0)) - 1, np.ceil(index.max(axis=0)) + 1
    share = 1
    while np.prod(np.ceil((high - low) / share)) > MOST_CELLS:
        share += 1
    shape = [max(ceil(n / share), 1) for n in high - low]
    index_from_grid = np.diag([share, share, share, 1.0])
    index_from_grid[:3, 3] = low - 0.5  # a voxel's value is that of its middle, where its index is
    return (shape[0], shape[1], shape[2]), local_from_index @ index_from_grid, share


def _sampled(obj: "bpy.types.Object", name: str, points: np.ndarray) -> np.ndarray:
    """A grid of an original volume object at points (n, 3) of its own frame, (n,) float32, without NaN."""
    with Temporary() as temporary:
        mesh = temporary.add(bpy.data.meshes.new("Photon Bake"))
        mesh.vertices.add(len(points))
        mesh.vertices.foreach_set("co", points.astype(np.float32).ravel())
        reader = temporary.add(bpy.data.objects.new("Photon Bake", mesh))
        reader.modifiers.new("Photon Bake", "NODES").node_group = temporary.add(_sampling_tree(obj, name))
        scene = temporary.add(bpy.data.scenes.new("Photon Bake"))
        scene.frame_current, scene.frame_subframe = bpy.context.scene.frame_current, bpy.context.scene.frame_subframe
        scene.collection.objects.link(reader)
        with bpy.context.temp_override(scene=scene, view_layer=scene.view_layers[0]):
            graph = bpy.context.evaluated_depsgraph_get()
        found = np.zeros(len(points), np.float32)
        attribute = reader.evaluated_get(graph).data.attributes.get(_SAMPLED)
        if attribute is not None:
            attribute.data.foreach_get("value", found)
    return np.nan_to_num(found, posinf=0.0, neginf=0.0)


_SAMPLED = "photon_bake_sampled"


def _sampling_tree(obj: "bpy.types.Object", name: str) -> "bpy.types.GeometryNodeTree":
    """Geometry nodes that store a grid of a volume object at each point of a mesh."""
    tree = bpy.data.node_groups.new("Photon Bake", "GeometryNodeTree")
    for side in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=side, socket_type="NodeSocketGeometry")
    points, out, info, grid, sample, store = _nodes(tree)
    info.inputs["Object"].default_value, info.transform_space = obj, "ORIGINAL"
    grid.data_type = sample.data_type = store.data_type = "FLOAT"
    grid.inputs["Name"].default_value, store.inputs["Name"].default_value = name, _SAMPLED
    for start, end in (
        (info.outputs["Geometry"], grid.inputs["Volume"]),
        (grid.outputs["Grid"], sample.inputs["Grid"]),
        (points.outputs[0], store.inputs["Geometry"]),
        (sample.outputs["Value"], store.inputs["Value"]),
        (store.outputs[0], out.inputs[0]),
    ):
        tree.links.new(start, end)
    return tree


def _nodes(tree: "bpy.types.GeometryNodeTree") -> "Iterator[bpy.types.Node]":
    kinds = ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeObjectInfo", "GeometryNodeGetNamedGrid")
    for kind in (*kinds, "GeometryNodeSampleGrid", "GeometryNodeStoreNamedAttribute"):
        yield tree.nodes.new(kind)
