"""The nodes that add a camera's pass to a render of direct light, put into a scene's compositor and taken out again."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import bpy

from ...core.errors import BakeError
from ...output.camera import GROUP_LAYER
from ..paths import from_blend_file, path_of
from ..read.materials.nodes import socket
from .direct_only import MARK, bring_back_indirect, leave_out_indirect, remove_switch, switch_with_indirect

_MIX_FACTOR, _MIX_A, _MIX_B, _MIX_RESULT = "Factor_Float", "A_Color", "B_Color", "Result_Color"
_NO_PASS = "{} is no camera's pass: choose a file that Bake Indirect wrote."
_LAYER = f"{MARK}_light_group"
"""Custom property of a node that multiplies a light group's light: the group's name; empty where it adds them up."""

Color = tuple[float, float, float]


def add_pass(scene: Any, paths: list[Path], mix: Mapping[str, Color] | None = None) -> None:
    """Add a pass's indirect light to what every Render Layers node of the scene's compositor gives.

    Cycles and EEVEE are kept to direct light besides; `remove_pass` sets them back. Where somebody sets them to more
    light again, the pass is off.

    Parameters
    ----------
    scene : bpy.types.Scene
    paths : list of Path
        The pass's files: one, or those of an animation's frames, the first one being the first frame.
    mix : dict of str to (r, g, b), optional
        What the light of each light group that the pass has apart is multiplied by; 1 where a group is not among them.

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
    light = _mixed(tree, source, mix or {})
    for render in renders:
        targets = [link.to_socket for link in render.outputs["Image"].links]
        place = render.location.x + 260, render.location.y
        node = _mix(tree, "ADD", "Add Indirect Light", place, render.outputs["Image"], light)
        switch_with_indirect(socket(node.inputs, _MIX_FACTOR), scene)
        for target in targets or [_output(tree).inputs[0]]:
            tree.links.new(socket(node.outputs, _MIX_RESULT), target)
    leave_out_indirect(scene)


def set_mix(scene: Any, mix: Mapping[str, Color]) -> None:
    """Change what the light groups' light in the compositor is multiplied by; nothing where no pass is."""
    tree = _existing_tree(scene)
    for node in tree.nodes if tree else []:
        if node.get(_LAYER) and node[_LAYER] in mix:
            socket(node.inputs, _MIX_B).default_value = (*mix[node[_LAYER]], 1)


def reload_pass(path: Path) -> None:
    """Have compositors show what a file has become: it may have other light groups apart than before."""
    images = [one for one in bpy.data.images if MARK in one and path_of(one) == path]
    for image in images:
        image.reload()
    for scene in bpy.data.scenes:
        tree = _existing_tree(scene)
        sources = [] if tree is None else [node for node in tree.nodes if getattr(node, "image", None) in images]
        for source in sources if images else []:
            source.image = source.image  # which has its sockets follow
            _mix_anew(tree, source)


def _mix_anew(tree: Any, source: Any) -> None:
    """Put other nodes between a pass and what it is added to, with the levels of those that were there."""
    apart = [node for node in tree.nodes if _LAYER in node]
    mix = {node[_LAYER]: tuple(socket(node.inputs, _MIX_B).default_value)[:3] for node in apart}
    for node in apart:
        tree.nodes.remove(node)
    light = _mixed(tree, source, mix)
    for node in [node for node in tree.nodes if MARK in node and node.bl_idname == "ShaderNodeMix"]:
        if _LAYER not in node:
            tree.links.new(light, socket(node.inputs, _MIX_B))


def _mixed(tree: Any, source: Any, mix: Mapping[str, Color]) -> Any:
    """The socket that gives all indirect light: the sum of the light groups' where the pass has them apart."""
    start = f"{GROUP_LAYER}_"
    apart = [one for one in source.outputs if one.enabled and one.name.startswith(start)]
    total = None if apart else source.outputs["Indirect"]
    for i, output in enumerate(apart):
        group, place = output.name.removeprefix(start), (-200, -150 - 60 * i)
        node = _mix(tree, "MULTIPLY", group, place, output)
        node[_LAYER], node.hide = group, True
        socket(node.inputs, _MIX_B).default_value = (*mix.get(group, (1, 1, 1)), 1)
        light = socket(node.outputs, _MIX_RESULT)
        if total is not None:
            node = _mix(tree, "ADD", "Add Light Groups", (-20, -150 - 60 * i), total, light)
            node[_LAYER], node.hide, light = "", True, socket(node.outputs, _MIX_RESULT)
        total = light
    return total


def _mix(tree: Any, blend: str, label: str, place: tuple[float, float], a: Any, b: Any = None) -> Any:
    """A node that mixes colors in whole, and its inputs linked."""
    node = _new(tree, "ShaderNodeMix", place)
    node.data_type, node.blend_type, node.label = "RGBA", blend, label
    socket(node.inputs, _MIX_FACTOR).default_value = 1.0
    tree.links.new(a, socket(node.inputs, _MIX_A))
    if b is not None:
        tree.links.new(b, socket(node.inputs, _MIX_B))
    return node


def has_pass_nodes(scene: Any) -> bool:
    """Whether the scene's compositor adds a pass."""
    tree = _existing_tree(scene)
    return tree is not None and any(MARK in node and node.bl_idname == "CompositorNodeImage" for node in tree.nodes)


def remove_pass(scene: Any) -> bool:
    """Take the nodes out again, and everything back to how it was; whether there were any."""
    bring_back_indirect(scene)
    tree = _existing_tree(scene)
    if tree is None:
        return False
    ours = [node for node in tree.nodes if MARK in node]
    for node in [node for node in ours if node.bl_idname == "ShaderNodeMix"]:
        remove_switch(socket(node.inputs, _MIX_FACTOR))
        before = next((link.from_socket for link in socket(node.inputs, _MIX_A).links), None)
        targets = [link.to_socket for link in socket(node.outputs, _MIX_RESULT).links]
        for target in targets if before and before.node.bl_idname == "CompositorNodeRLayers" else []:
            tree.links.new(before, target)
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
    image.filepath = from_blend_file(paths[0])
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
