"""The nodes that add a camera's pass to a render of direct light, put into a scene's compositor and taken out again."""

import re
from pathlib import Path
from typing import Any

import bpy

from ..errors import BakeError

MARK = "photon_bake"
"""Custom property of the nodes, trees and scenes that are ours."""

_MIX_A, _MIX_B, _MIX_RESULT = "A_Color", "B_Color", "Result_Color"
_NO_PASS = "{} is no camera's pass: choose a file that Bake Indirect wrote."
_BOUNCES = f"{MARK}_max_bounces"


def add_pass(scene: Any, paths: list[Path]) -> None:
    """Add a pass's indirect light to what every Render Layers node of the scene's compositor gives.

    Cycles' bounces are set to 0 besides, so that its renders have direct light alone; `remove_pass` sets them back.

    Parameters
    ----------
    scene : bpy.types.Scene
    paths : list of Path
        The pass's files: one, or those of an animation's frames, the first one being the first frame.

    Raises
    ------
    BakeError
        If a file is not there or is no camera's pass.
    """
    image = _load(paths)
    remove_pass(scene)
    tree = _tree(scene)
    renders = [node for node in tree.nodes if node.bl_idname == "CompositorNodeRLayers"]
    if not renders:
        renders = [_new(tree, "CompositorNodeRLayers", (-400, 300))]
    source = _image_node(tree, image, paths)
    if "Indirect" not in source.outputs:
        remove_pass(scene)
        raise BakeError(_NO_PASS.format(paths[0]))
    for render in renders:
        mix = _new(tree, "ShaderNodeMix", (render.location.x + 260, render.location.y))
        mix.data_type, mix.blend_type, mix.label = "RGBA", "ADD", "Add Indirect Light"
        _socket(mix.inputs, "Factor_Float").default_value = 1.0
        targets = [link.to_socket for link in render.outputs["Image"].links]
        _link(tree, render.outputs["Image"], _socket(mix.inputs, _MIX_A))
        _link(tree, source.outputs["Indirect"], _socket(mix.inputs, _MIX_B))
        for target in targets or [_output(tree).inputs[0]]:
            _link(tree, _socket(mix.outputs, _MIX_RESULT), target)
    if scene.render.engine == "CYCLES" and _BOUNCES not in scene:
        scene[_BOUNCES] = scene.cycles.max_bounces
        scene.cycles.max_bounces = 0


def remove_pass(scene: Any) -> bool:
    """Take the nodes out again, and everything back to how it was; whether there were any."""
    if _BOUNCES in scene:
        scene.cycles.max_bounces = scene[_BOUNCES]
        del scene[_BOUNCES]
    tree = _existing_tree(scene)
    if tree is None:
        return False
    ours = [node for node in tree.nodes if MARK in node]
    for node in [node for node in ours if node.bl_idname == "ShaderNodeMix"]:
        render = next((link.from_socket for link in _socket(node.inputs, _MIX_A).links), None)
        targets = [link.to_socket for link in _socket(node.outputs, _MIX_RESULT).links]
        for target in targets if render else []:
            _link(tree, render, target)
    images = [node.image for node in ours if node.bl_idname == "CompositorNodeImage" and node.image]
    for node in ours:
        tree.nodes.remove(node)
    for image in images:
        if MARK in image and not image.users:
            bpy.data.images.remove(image)
    if MARK in tree:
        _drop_tree(scene, tree)
    return bool(ours)


def _load(paths: list[Path]) -> Any:
    """The image of a pass's files."""
    if not paths[0].is_file():
        raise BakeError(f"{paths[0]} is not there: bake the camera's pass first.")
    image = bpy.data.images.load(str(paths[0]))
    image[MARK] = True
    if len(paths) > 1:
        image.source = "SEQUENCE"
    return image


def _image_node(tree: Any, image: Any, paths: list[Path]) -> Any:
    """A node that gives the pass of the frame that is rendered."""
    node = _new(tree, "CompositorNodeImage", (-400, -150))
    node.image, node.label = image, "Indirect Light"
    if image.source == "SEQUENCE":
        first = frame_of(paths[0])
        node.frame_duration, node.frame_start, node.frame_offset = len(paths), first, first - 1
        node.use_auto_refresh = True
    return node


def frame_of(path: Path) -> int:
    """The number of the frame, the last one in a file's name; 1 without one."""
    digits = re.findall(r"\d+", path.stem)
    return int(digits[-1]) if digits else 1


def _existing_tree(scene: Any) -> Any:
    """The scene's compositing nodes; None without any."""
    if hasattr(scene, "compositing_node_group"):
        return scene.compositing_node_group
    return scene.node_tree if scene.use_nodes else None


def _tree(scene: Any) -> Any:
    """The scene's compositing nodes, made where there are none."""
    tree = _existing_tree(scene)
    if tree is not None:
        return tree
    if hasattr(scene, "compositing_node_group"):
        tree = bpy.data.node_groups.new("Compositing", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        scene.compositing_node_group = tree
    else:
        scene.use_nodes = True
        tree = scene.node_tree
        tree.nodes.clear()
    tree[MARK] = True
    return tree


def _drop_tree(scene: Any, tree: Any) -> None:
    """Undo what `_tree` made, unless somebody has built on it."""
    if len(tree.nodes):
        del tree[MARK]
    elif hasattr(scene, "compositing_node_group"):
        bpy.data.node_groups.remove(tree)
    else:
        del tree[MARK]
        scene.use_nodes = False


def _output(tree: Any) -> Any:
    """The node that takes the composed picture."""
    idname = "CompositorNodeComposite" if hasattr(bpy.types, "CompositorNodeComposite") else "NodeGroupOutput"
    return next((node for node in tree.nodes if node.bl_idname == idname), None) or _new(tree, idname, (200, 300))


def _new(tree: Any, idname: str, location: tuple[float, float]) -> Any:
    node = tree.nodes.new(idname)
    node.location, node[MARK] = location, True
    return node


def _link(tree: Any, source: Any, target: Any) -> None:
    tree.links.new(source, target)


def _socket(sockets: Any, identifier: str) -> Any:
    """A socket by its identifier: several have one name."""
    return next(socket for socket in sockets if socket.identifier == identifier)
