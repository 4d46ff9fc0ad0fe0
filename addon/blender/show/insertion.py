"""The group behind shaders of node trees, and out of them again."""

from collections.abc import Iterable, Iterator
from typing import Any

import bpy

from ..read.materials.nodes import SHOWN, all_nodes

_SAMPLING = "photon_bake_emission_sampling"
"""Custom property of materials: how Cycles sampled their emission before; empty where nobody had said."""

_PRINCIPLED = {
    "Base Color": "Base Color",
    "Metallic": "Metallic",
    "Transmission": "Transmission Weight",
    "Alpha": "Alpha",
    "Roughness": "Roughness",
    "IOR": "IOR",
    "Specular": "Specular IOR Level",
}
_COLOR_ALONE = {"Base Color": "Color"}
SHADERS = {
    "BSDF_PRINCIPLED": _PRINCIPLED,
    "BSDF_DIFFUSE": _COLOR_ALONE,
    "BSDF_TRANSLUCENT": _COLOR_ALONE,
    "SUBSURFACE_SCATTERING": _COLOR_ALONE,
}
"""Types of the shaders that show light, with the inputs of theirs that those of the group are taken from."""


def insert(
    materials: "Iterable[bpy.types.Material]", group: "bpy.types.NodeTree", left_out: "set[str] | None" = None
) -> None:
    """Put the group behind each shader of materials, but for types that are left out; also in their groups."""
    done: set[bpy.types.NodeTree] = set()
    for material in materials:
        for tree in _trees(material.node_tree):
            if tree not in done:
                done.add(tree)
                _insert(tree, group, left_out or set())
        _mute_emission(material)


def take_out() -> None:
    """Undo `insert` in the whole file."""
    for material in bpy.data.materials:
        if _SAMPLING in material:
            if material[_SAMPLING]:
                material.cycles.emission_sampling = material[_SAMPLING]
            else:
                material.cycles.property_unset("emission_sampling")
            del material[_SAMPLING]
    for tree in [*(one.node_tree for one in bpy.data.materials if one.node_tree), *bpy.data.node_groups]:
        if tree.bl_idname == "ShaderNodeTree" and tree.is_editable:
            _take_out(tree)
    bpy.data.batch_remove([group for group in bpy.data.node_groups if SHOWN in group])


def _trees(tree: "bpy.types.NodeTree") -> "Iterator[bpy.types.NodeTree]":
    """A node tree and those of its groups that can be changed, each once."""
    trees = [tree]
    for one in trees:  # grows as groups are found
        yield one
        groups = (node.node_tree for node in one.nodes if node.type == "GROUP" and SHOWN not in node)
        trees += [group for group in dict.fromkeys(groups) if group and group.is_editable and group not in trees]


def _insert(tree: "bpy.types.NodeTree", group: "bpy.types.NodeTree", left_out: set[str]) -> None:
    active = tree.nodes.active
    for node in list(tree.nodes):
        if node.type not in SHADERS or node.type in left_out or node.mute:
            continue
        targets = [link.to_socket for link in node.outputs[0].links if not link.is_muted]
        if not targets:
            continue
        added = tree.nodes.new("ShaderNodeGroup")
        added.node_tree, added.select, added.hide, added[SHOWN] = group, False, True, True
        added.label, added.parent = "Baked Light", node.parent
        added.location = (node.location.x + node.width, node.location.y + 40)
        tree.links.new(node.outputs[0], added.inputs["Shader"])
        for name, socket in SHADERS[node.type].items():
            _copy_input(tree, node.inputs[socket], added.inputs[name])
        for target in targets:
            tree.links.new(added.outputs["Shader"], target)
    tree.nodes.active = active


def follow(tree: "bpy.types.NodeTree") -> None:
    """Give the group's nodes what the shaders before them have by now."""
    for node in [node for node in tree.nodes if SHOWN in node and node.type == "GROUP"]:
        for link in node.inputs["Shader"].links:
            for name, socket in SHADERS.get(link.from_node.type, {}).items():
                _copy_input(tree, link.from_node.inputs[socket], node.inputs[name])


def _copy_input(tree: "bpy.types.NodeTree", given: Any, taken: Any) -> None:
    """Let an input have what another has, a link or a value, where it has not got it yet."""
    if given.is_linked:
        source = given.links[0].from_socket
        if not (taken.is_linked and taken.links[0].from_socket == source):
            tree.links.new(source, taken)
        return
    for link in list(taken.links):
        tree.links.remove(link)
    ours, theirs = taken.default_value, given.default_value
    if (tuple(ours) != tuple(theirs)) if hasattr(theirs, "__len__") else ours != theirs:
        taken.default_value = theirs


def _take_out(tree: "bpy.types.NodeTree") -> None:
    for node in [node for node in tree.nodes if SHOWN in node]:
        before = node.inputs["Shader"].links
        for link in list(node.outputs["Shader"].links):
            if before:
                tree.links.new(before[0].from_socket, link.to_socket)
        tree.nodes.remove(node)


def _mute_emission(material: "bpy.types.Material") -> None:
    """Baked light lights nothing else, so Cycles need not sample it as a lamp."""
    if not hasattr(material, "cycles") or _emits(material):
        return
    is_set = material.cycles.is_property_set("emission_sampling")
    material[_SAMPLING] = material.cycles.emission_sampling if is_set else ""
    material.cycles.emission_sampling = "NONE"


def _emits(material: "bpy.types.Material") -> bool:
    """Whether a material may shine by itself."""
    for node in all_nodes(material.node_tree):
        strength = node.inputs.get("Emission Strength")
        if node.type == "EMISSION" or (strength is not None and (strength.is_linked or strength.default_value > 0)):
            return True
    return False
