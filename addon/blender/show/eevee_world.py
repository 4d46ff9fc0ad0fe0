"""How much of the world's light EEVEE lets in while baked light is shown, or a camera's pass is added.

EEVEE lights surfaces by the world as if nothing stood before it, which fills closed rooms with sky. Cycles' direct
light of the world is what surfaces see of it. So for EEVEE alone the world's light is multiplied by the mean share of
the hemisphere that lit surfaces have open; the world itself looks as before.
"""

from collections.abc import Iterable, Sequence

import bpy
import numpy as np

from ..read.materials.nodes import SHOWN, uses_nodes
from .tree_builder import TreeBuilder

_N_POINTS, _N_RAYS = 256, 16

_SHARE = "photon_bake_share"
"""Custom property of the node that dims a world: by what."""


def dim_world(scene: "bpy.types.Scene", lit: "Sequence[bpy.types.Object]", owner: bool | str = True) -> None:
    """Give the scene's world an output of its own for EEVEE, dimmed by what lit objects see of it.

    `owner` is for `restore_worlds`; a world that somebody has dimmed stays as it is.
    """
    world = scene.world
    if world is None or not uses_nodes(world) or not world.is_editable:
        return
    tree = world.node_tree
    output = tree.get_output_node("EEVEE")
    source = output.inputs["Surface"].links[0].from_socket if output and output.inputs["Surface"].is_linked else None
    if source is None or output.target == "EEVEE":
        return
    before, active = set(tree.nodes), tree.nodes.active
    builder, share = TreeBuilder(tree), sky_share(scene, lit)
    is_camera = builder.add("ShaderNodeLightPath").outputs["Is Camera Ray"]
    dark = builder.add("ShaderNodeBackground", Strength=0.0).outputs[0]
    factor = builder.math("MAXIMUM", is_camera, share)
    factor.node[_SHARE] = share
    mix = builder.add("ShaderNodeMixShader", Fac=factor)
    builder.link(dark, mix.inputs[1])
    builder.link(source, mix.inputs[2])
    builder.add("ShaderNodeOutputWorld", {"target": "EEVEE"}, Surface=mix.outputs[0])
    for node in set(tree.nodes) - before:
        node[SHOWN], node.select, node.hide = owner, False, True
        node.location = (output.location.x, output.location.y - 200)
    tree.nodes.active = active


def set_worlds_dim(dim: bool) -> None:
    """Dim worlds for EEVEE, or let their whole light in for a while."""
    for world in bpy.data.worlds:
        for node in world.node_tree.nodes if world.node_tree else ():
            if _SHARE in node and node[SHOWN] is True:
                node.inputs[1].default_value = node[_SHARE] if dim else 1.0


def restore_worlds(owner: bool | str = True, kept: "Sequence[bpy.types.World]" = ()) -> None:
    """Undo an owner's `dim_world` in the whole file, but for worlds that are kept."""
    for world in bpy.data.worlds:
        nodes = world.node_tree.nodes if world.node_tree and world not in kept else ()
        for node in [node for node in nodes if node.get(SHOWN) == owner]:
            world.node_tree.nodes.remove(node)


def sky_share(scene: "bpy.types.Scene", objects: "Sequence[bpy.types.Object]") -> float:
    """The mean share of the cosine-weighted hemisphere over objects' faces that nothing covers, in [0, 1].

    Faces are drawn by their area and looked from on the side that the camera sees.
    """
    depsgraph = bpy.context.evaluated_depsgraph_get()
    if depsgraph.scene.original != scene:
        depsgraph = scene.view_layers[0].depsgraph or depsgraph
    points, normals = _points(objects, scene.camera)
    if len(points) == 0:
        return 1.0
    i = np.arange(_N_RAYS) + 0.5
    height, angle = np.sqrt(1 - i / _N_RAYS), i * np.pi * (1 + 5**0.5)  # sunflower points of the disc, lifted
    width = np.sqrt(1 - height**2)
    local = np.stack([width * np.cos(angle), width * np.sin(angle), height], axis=1)
    scale = 1e-4 * max(float(np.ptp(points, axis=0).max()), 1e-3)
    n_open = 0
    for point, normal in zip(points, normals, strict=True):
        axis = np.cross(normal, (1.0, 0, 0) if abs(normal[0]) < 0.9 else (0, 1.0, 0))
        axis /= np.linalg.norm(axis)
        directions = local @ np.stack([axis, np.cross(normal, axis), normal])
        start = point + scale * normal
        n_open += sum(not scene.ray_cast(depsgraph, start, direction)[0] for direction in directions)
    return n_open / (len(points) * _N_RAYS)


def _points(objects: "Iterable[bpy.types.Object]", camera: "bpy.types.Object | None") -> tuple[np.ndarray, np.ndarray]:
    """Middles of faces of objects and unit normals there, (n, 3) float64 each, evenly over their area."""
    centers, scaled = [np.empty((0, 3))], [np.empty((0, 3))]
    for obj in objects:
        faces = obj.data.polygons
        if len(faces) == 0:
            continue
        center, normal, area = np.empty((len(faces), 3)), np.empty((len(faces), 3)), np.empty(len(faces))
        for name, values in (("center", center), ("normal", normal), ("area", area)):
            faces.foreach_get(name, values.reshape(-1))
        matrix = np.array(obj.matrix_world, np.float64)
        linear = matrix[:3, :3]
        cofactors = np.linalg.det(linear) * np.linalg.pinv(linear).T
        centers.append(center @ linear.T + matrix[:3, 3])
        scaled.append(area[:, None] * normal @ cofactors.T)
    center, normal = np.concatenate(centers), np.concatenate(scaled)
    area = np.linalg.norm(normal, axis=1)
    if not area.sum() > 0:
        return center[:0], normal[:0]
    drawn = np.searchsorted(np.cumsum(area), (np.arange(_N_POINTS) + 0.5) / _N_POINTS * area.sum())
    center, normal = center[drawn], normal[drawn] / area[drawn, None]
    if camera is not None:
        seen = np.array(camera.matrix_world.translation) - center
        normal = normal * np.where((normal * seen).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
    return center, normal
