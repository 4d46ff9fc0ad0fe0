"""What objects say of their own bakes: settings on objects themselves, which files keep and the command heeds."""

from collections.abc import Iterable
from typing import Any

import bpy

from ..core.errors import Advice
from .warn import Warnings, listed

NEVER = "never"
"""Of `refine`: the object's mesh stays as it is."""


def _setting(obj: "bpy.types.Object", name: str, default: Any) -> Any:
    """One of an object's settings; asking for them would store them on objects that have none."""
    has_any = hasattr(bpy.types.Object, "photon_bake") and obj.is_property_set("photon_bake")
    return getattr(obj.photon_bake, name) if has_any else default


def is_excluded(obj: "bpy.types.Object") -> bool:
    """Whether an object is to get no light; it casts and reflects as ever."""
    return bool(_setting(obj, "exclude", False))


def keeps_its_mesh(obj: "bpy.types.Object") -> bool:
    """Whether an object's mesh is never to be refined."""
    return bool(_setting(obj, "refine", "") == NEVER)


def density_factor(obj: "bpy.types.Object") -> float:
    """Factor of an object's texels a metre in lightmaps."""
    return float(_setting(obj, "density", 1.0))


def density_factors(objects: "Iterable[bpy.types.Object]") -> dict[str, float]:
    """The factors of objects that have another one than 1, by their names."""
    return {obj.name: factor for obj in objects if (factor := density_factor(obj)) != 1}


def without_excluded(objects: "Iterable[bpy.types.Object]", warnings: Warnings) -> "list[bpy.types.Object]":
    """The objects that are to get light; the others are named in a sentence."""
    there, names = [], []
    for obj in objects:
        if is_excluded(obj):
            names.append(f"'{obj.name}'")
        else:
            there.append(obj)
    if names:
        warnings.add(Advice(f"{len(names)} object(s) are excluded by their own settings ({listed(names)})."))
    return there
