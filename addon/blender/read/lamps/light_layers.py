"""Light groups baked apart: the names of what holds each group's light, beside what holds all light.

| | All light | Group Key |
|---|---|---|
| color attribute | Indirect | Indirect.Key |
| lightmap's file | scene_Floor_indirect.exr | scene_Floor_indirect.Key.exr |
| custom property of objects | lightmap_image | lightmap_image.Key |
| layer of a camera's pass | Indirect | Indirect_Key |
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import bpy

from ....core.errors import BakeError
from ....output import file_name
from ....output.camera import GROUP_LAYER
from ....scene import OTHER
from ....settings.frames import Frames
from ....settings.lightmap import LightmapSettings
from ...lightmap.images import load_lightmaps
from ...lightmap.layout import Layout
from ...lightmap.writing import IMAGE
from ...write.color_attribute import MAX_NAME_BYTES


def attribute_of(attribute: str, group: str) -> str:
    """The color attribute that holds a group's light."""
    return f"{attribute}.{group}"


def property_of(group: str) -> str:
    """The custom property of objects that names the file of their lightmap of a group."""
    return f"{IMAGE}.{group}"


def with_groups(name: str, names: Iterable[str]) -> list[str]:
    """Those of some attributes or properties that hold all light under a name, or a group's beside it."""
    return [one for one in names if one == name or one.startswith(f"{name}.")]


def group_names(view_layer: Any, attribute: str = "") -> tuple[str, ...]:
    """The layers that a bake of a view layer's light groups apart may make, the light in no group at the end.

    Parameters
    ----------
    view_layer : bpy.types.ViewLayer
    attribute : str
        The color attribute of all light; empty where none is written.

    Raises
    ------
    BakeError
        If there are no light groups, or two layers would have one name, or one too long for Blender.
    """
    names = tuple(group.name for group in view_layer.lightgroups)
    if not names:
        raise BakeError(
            f"View layer '{view_layer.name}' has no light groups to bake apart: make some (View Layer Properties > "
            "Light Groups) and put lights into them (Object Properties > Shading), or bake all together."
        )
    files: dict[str, str] = {OTHER.lower(): ""}
    for name in names:
        other = files.setdefault(file_name(name).lower(), name)
        if other == "":
            raise BakeError(f"Light group '{name}' has the name of the light that is in no group: rename it.")
        if other != name:
            raise BakeError(f"Light groups '{other}' and '{name}' would have files of one name: rename one of them.")
        longest = max(len(prefix.encode()) for prefix in (f"{attribute}." if attribute else "", f"{GROUP_LAYER}_"))
        if longest + len(name.encode()) > MAX_NAME_BYTES:
            raise BakeError(
                f"Light group '{name}' has a name too long to be put after '{attribute or GROUP_LAYER}' in the "
                f"{MAX_NAME_BYTES} bytes that Blender's names may have: shorten it."
            )
    return (*names, OTHER)


def write_lightmap_layers(
    layout: Layout,
    objects: "Sequence[bpy.types.Object | None]",
    paths: Mapping[str, Mapping[int, Path]],
    settings: LightmapSettings,
    frames: Frames | None = None,
) -> None:
    """Give objects the names of their groups' lightmaps, in place of those of earlier bakes, and load the files.

    Parameters
    ----------
    layout, objects, settings, frames
        As for `write_lightmaps`, which comes first.
    paths : dict of str to dict of int to Path
        By group, its files by image.
    """
    for place, obj in zip(layout.places, objects, strict=True):
        if obj is None or not obj.is_editable:
            continue
        for name in with_groups(IMAGE, obj.keys()):
            if name != IMAGE:
                del obj[name]
        for group, of_image in paths.items():
            if place.image in of_image:
                obj[property_of(group)] = of_image[place.image].name
    for group, of_image in paths.items():
        load_lightmaps(list(of_image.values()), [f"{layout.names[i]}.{group}" for i in of_image], settings, frames)
