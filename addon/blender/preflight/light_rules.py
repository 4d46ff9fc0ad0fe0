"""Whether there is light at all, and whether files that it needs are there."""

from collections.abc import Callable
from pathlib import Path

import bpy

from ...core.findings import counted
from ..read.materials.nodes import all_nodes, uses_nodes
from .asked import Asked
from .found import Found, of_bake


def _no_light(asked: Asked) -> list[Found]:
    if not asked.targets or _has_lamp(asked) or _has_world(asked) or _has_emission(asked):
        return []
    why = "No lamp, no emissive material and no world color: what is baked would be black."
    return of_bake("Nothing gives light", why, "add_light", blocks=False)


def _has_lamp(asked: Asked) -> bool:
    return any(obj.type == "LIGHT" and obj.data.energy for obj in asked.shown)


def _has_world(asked: Asked) -> bool:
    world = asked.scene.world
    if world is None:
        return False
    if not uses_nodes(world):
        return any(world.color)
    return any(
        node.type != "BACKGROUND" or _gives(node.inputs["Color"], node.inputs["Strength"])
        for node in all_nodes(world.node_tree)
        if node.type in {"BACKGROUND", "EMISSION", "TEX_ENVIRONMENT", "TEX_SKY"}
    )


def _has_emission(asked: Asked) -> bool:
    slots = (slot.material for obj in asked.shown for slot in obj.material_slots)
    return any(_emits(material) for material in dict.fromkeys(slots) if material is not None)


def _emits(material: "bpy.types.Material") -> bool:
    if material.node_tree is None:
        return False
    for node in all_nodes(material.node_tree):
        if node.type == "EMISSION" and _gives(node.inputs["Color"], node.inputs["Strength"]):
            return True
        if node.type == "BSDF_PRINCIPLED" and _gives(node.inputs["Emission Color"], node.inputs["Emission Strength"]):
            return True
    return False


def _gives(color: "bpy.types.NodeSocket", strength: "bpy.types.NodeSocket") -> bool:
    """Whether a color times a strength may be anything but black."""
    some_color = color.is_linked or any(color.default_value[:3])
    return bool(some_color and (strength.is_linked or strength.default_value))


def _missing(asked: Asked) -> list[Found]:
    names = [
        Path(image.filepath).name
        for image in bpy.data.images
        if image.source == "FILE"
        and image.users
        and image.filepath
        and not image.packed_file
        and not Path(bpy.path.abspath(image.filepath, library=image.library)).is_file()
    ]
    if not names:
        return []
    are = "is" if len(names) == 1 else "are"
    return of_bake(
        f"{counted(len(names), 'image file')} {are} missing",
        "Renders show magenta in their place: " + ", ".join(names[:5]) + (", …" if len(names) > 5 else ""),
        "find_missing",
        blocks=False,
    )


RULES: tuple[Callable[[Asked], list[Found]], ...] = (_no_light, _missing)
