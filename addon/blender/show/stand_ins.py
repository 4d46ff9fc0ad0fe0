"""Materials of our own for slots that hold none, or one that no node can be put into."""

from collections.abc import Iterable
from typing import Any

import bpy
import numpy as np

from ..read.materials.nodes import SHOWN, uses_nodes

_ORIGINAL = "photon_bake_original"
"""Custom property of a stand-in: the material that it stands for; missing where there was none."""

_SLOT = "photon_bake_slot"
"""Custom property of meshes that had no slot for materials."""

_GREY = (0.8, 0.8, 0.8)
"""What Cycles shows faces without a material in."""


def add_stand_ins(objects: "Iterable[bpy.types.Object]", warnings: list[str]) -> "list[bpy.types.Material]":
    """Give objects materials with nodes that can be changed where they have none; returns all their materials."""
    materials: dict[bpy.types.Material, None] = {}
    made: dict[bpy.types.Material | None, bpy.types.Material] = {}
    for obj in objects:
        mesh = obj.data
        if not obj.material_slots and mesh.is_editable:
            mesh[_SLOT] = True
            mesh.materials.append(None)
        for slot in obj.material_slots:
            material = slot.material
            if material is None or not uses_nodes(material) or not material.is_editable:
                if not (obj if slot.link == "OBJECT" else mesh).is_editable:
                    warnings.append(_cannot_show(obj))
                    continue
                if material not in made:
                    made[material] = _stand_in(material)
                material = slot.material = made[material]
            materials[material] = None
        if not obj.material_slots:
            warnings.append(_cannot_show(obj))
    return list(materials)


def drop_stand_ins() -> None:
    """Undo `add_stand_ins` in the whole file."""
    stand_ins = [material for material in bpy.data.materials if SHOWN in material]
    if stand_ins:
        for mesh in bpy.data.meshes:
            for i, material in enumerate(mesh.materials):
                if material is not None and SHOWN in material:
                    mesh.materials[i] = material.get(_ORIGINAL)
        for obj in bpy.data.objects:
            for slot in obj.material_slots:
                if slot.link == "OBJECT" and slot.material is not None and SHOWN in slot.material:
                    slot.material = slot.material.get(_ORIGINAL)
    for mesh in [mesh for mesh in bpy.data.meshes if _SLOT in mesh]:
        del mesh[_SLOT]
        if len(mesh.materials) == 1 and mesh.materials[0] is None:
            _drop_slot(mesh)
    bpy.data.batch_remove(stand_ins)


def _cannot_show(obj: "bpy.types.Object") -> str:
    return (
        f"Object '{obj.name}' cannot show its baked light, since its materials are linked from another file: make "
        "them local (Object > Relations > Make Local)."
    )


def _stand_in(material: "bpy.types.Material | None") -> "bpy.types.Material":
    """A material that looks like another, or like none."""
    if material is not None and uses_nodes(material):  # linked, whose copy is local
        copy = material.copy()
    else:
        copy = bpy.data.materials.new("Photon Bake Default" if material is None else "Photon Bake Stand-in")
        _make_matte(copy, _GREY if material is None else material.diffuse_color[:3])
    copy[SHOWN] = True
    if material is not None:
        copy.name = f"Photon Bake {material.name}"
        copy[_ORIGINAL] = material
    return copy


def _make_matte(material: "bpy.types.Material", color: Any) -> None:
    if bpy.app.version < (5, 0, 0):  # from then on a material always has nodes
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader, output = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeOutputMaterial")
    shader.inputs["Color"].default_value = (*color, 1.0)
    material.diffuse_color = (*color, 1.0)
    tree.links.new(shader.outputs[0], output.inputs["Surface"])


def _drop_slot(mesh: "bpy.types.Mesh") -> None:
    """Take the only slot away; Blender would take the faces' numbers of their slots with it."""
    index = mesh.attributes.get("material_index")
    if index is not None:
        before = np.empty(len(index.data), np.int32)
        index.data.foreach_get("value", before)
    mesh.materials.clear()
    if index is not None:
        index = mesh.attributes.get("material_index") or mesh.attributes.new("material_index", "INT", "FACE")
        index.data.foreach_set("value", before)
