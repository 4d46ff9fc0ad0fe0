"""Lightmaps shown in materials: a group behind each diffuse shader adds base colour × lightmap, and goes again.

For the time being, objects also have a property that says which of their materials' images is theirs.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

import bpy

from .lightmap.images import lightmap_of_file
from .lightmap.writing import IMAGE, SCALE_OFFSET, UV_MAP
from .nodes import output_node
from .preview_group import Lit, preview_group

MARK = "photon_bake_preview"
"""Custom property of what the preview added: of group nodes, of node groups, and of objects, where it is a number."""

_SAMPLING = "photon_bake_emission_sampling"  # of a group node: what its material had before

DIFFUSE = {
    "BSDF_PRINCIPLED": ("Base Color", "Metallic", "Transmission Weight"),
    "BSDF_DIFFUSE": ("Color",),
}
"""Shaders that show light on a surface: their sockets for the colour, and for what is not diffuse about them."""


@dataclass
class _Wanted:
    """What each node tree shows: images with their UV maps; and each object's number among all of these."""

    all: list[Lit] = field(default_factory=list)
    of_tree: dict["bpy.types.NodeTree", list[int]] = field(default_factory=dict)
    materials: dict["bpy.types.Material", None] = field(default_factory=dict)


def show_lightmaps(objects: "Iterable[bpy.types.Object]") -> list[str]:
    """Show the lightmaps of those objects that have one; returns warnings about those that cannot show it.

    Meant to be looked at with direct light only: Cycles' own bounces would come on top.
    """
    objects = list(objects)
    hide_lightmaps()
    warnings: list[str] = []
    wanted = _Wanted()
    for obj in objects:
        if IMAGE in obj and SCALE_OFFSET in obj:
            _want(obj, wanted, warnings)
    groups: dict[tuple[int, ...], bpy.types.NodeTree] = {}
    for tree, numbers in wanted.of_tree.items():
        key = tuple(sorted(numbers))
        if key not in groups:
            groups[key] = preview_group({number + 1: wanted.all[number] for number in key}, MARK)
            groups[key][MARK] = True
        _insert(tree, groups[key])
    for material in wanted.materials:
        _mute_emission(material)
    return warnings


def _want(obj: "bpy.types.Object", wanted: _Wanted, warnings: list[str]) -> None:
    image = lightmap_of_file(obj[IMAGE])
    if image is None:
        warnings.append(f"The lightmap '{obj[IMAGE]}' of object '{obj.name}' is not in this file: bake it again.")
        return
    materials = [slot.material for slot in obj.material_slots if slot.material is not None]
    able = [one for one in materials if one.node_tree is not None and one.is_editable and output_node(one) is not None]
    if not able:
        warnings.append(f"Object '{obj.name}' has no material with nodes that could show its lightmap: give it one.")
        return
    lit = Lit(image, obj[UV_MAP])
    if lit not in wanted.all:
        wanted.all.append(lit)
    number = wanted.all.index(lit)
    obj[MARK] = number + 1
    for material in able:
        wanted.materials[material] = None
        for tree in _trees(material.node_tree):
            numbers = wanted.of_tree.setdefault(tree, [])
            if number not in numbers:
                numbers.append(number)


def _trees(tree: "bpy.types.NodeTree") -> "Iterator[bpy.types.NodeTree]":
    """A node tree and those of its groups."""
    yield tree
    for node in tree.nodes:
        if node.type == "GROUP" and node.node_tree is not None and node.node_tree.is_editable:
            yield from _trees(node.node_tree)


def _insert(tree: "bpy.types.NodeTree", group: "bpy.types.NodeTree") -> None:
    """Put the group behind each diffuse shader of a tree."""
    active = tree.nodes.active
    for node in list(tree.nodes):
        targets = [link.to_socket for link in node.outputs[0].links if not link.is_muted] if node.outputs else []
        if node.type not in DIFFUSE or node.mute or not targets:
            continue
        added = tree.nodes.new("ShaderNodeGroup")
        added.node_tree, added.select, added.hide, added[MARK] = group, False, True, True
        added.location = (node.location.x + node.width, node.location.y + 40)
        tree.links.new(node.outputs[0], added.inputs["Shader"])
        for name, socket in zip(("Base Color", "Metallic", "Transmission"), DIFFUSE[node.type], strict=False):
            _copy_input(tree, node.inputs[socket], added.inputs[name])
        for target in targets:
            tree.links.new(added.outputs["Shader"], target)
    tree.nodes.active = active


def _copy_input(tree: "bpy.types.NodeTree", given: Any, taken: Any) -> None:
    if given.is_linked:
        tree.links.new(given.links[0].from_socket, taken)
    else:
        taken.default_value = given.default_value


def _mute_emission(material: "bpy.types.Material") -> None:
    """What the camera alone sees lights nothing, so Cycles need not sample it."""
    added = next((node for tree in _trees(material.node_tree) for node in tree.nodes if MARK in node), None)
    if added is None or not hasattr(material, "cycles") or _emits(material):
        return
    material[_SAMPLING] = material.cycles.emission_sampling
    material.cycles.emission_sampling = "NONE"


def _emits(material: "bpy.types.Material") -> bool:
    """Whether a material may shine by itself."""
    for tree in _trees(material.node_tree):
        for node in tree.nodes:
            strength = node.inputs.get("Emission Strength")
            shines = strength is not None and (strength.is_linked or strength.default_value > 0)
            if node.type == "EMISSION" or shines:
                return True
    return False


def hide_lightmaps() -> None:
    """Take out of all materials and objects what `show_lightmaps` put in."""
    for material in bpy.data.materials:
        if _SAMPLING in material:
            material.cycles.emission_sampling = material[_SAMPLING]
            del material[_SAMPLING]
    for tree in [*(one.node_tree for one in bpy.data.materials if one.node_tree), *bpy.data.node_groups]:
        if tree.bl_idname == "ShaderNodeTree":
            _remove(tree)
    for group in [group for group in bpy.data.node_groups if MARK in group]:
        bpy.data.node_groups.remove(group)
    for obj in bpy.data.objects:
        if MARK in obj:
            del obj[MARK]


def _remove(tree: "bpy.types.NodeTree") -> None:
    for node in [node for node in tree.nodes if MARK in node]:
        before = node.inputs["Shader"].links
        for link in list(node.outputs["Shader"].links):
            if before:
                tree.links.new(before[0].from_socket, link.to_socket)
        tree.nodes.remove(node)
