"""The modifiers that play light back, put in and taken out."""

from collections.abc import Iterable, Sequence

import bpy

from ...settings.frames import Frames
from .node_group import Track, playback_group

MODIFIER = "Photon Bake Playback"

_OURS = "photon_bake_playback"
"""Custom property of the node groups and images of playback."""


def add_playback(obj: "bpy.types.Object", tracks: Sequence[Track], frames: Frames, domain: str) -> None:
    """Let an object play tracks back, in place of what it played before.

    The modifier is the first, as the tracks are of the stored mesh's elements: modifiers after it take the attributes
    along as they take any other.
    """
    _drop(obj)
    group = playback_group(f"{MODIFIER} {obj.name}", tracks, frames, domain)
    group[_OURS] = True
    for track in tracks:
        track.image[_OURS] = True
    modifier = obj.modifiers.new(MODIFIER, "NODES")
    modifier.node_group = group
    obj.modifiers.move(len(obj.modifiers) - 1, 0)


def has_playback(objects: "Iterable[bpy.types.Object]") -> bool:
    """Whether some object plays light back."""
    return any(_ours(modifier) for obj in objects for modifier in obj.modifiers)


def remove_playback() -> int:
    """Take all playback out of the file; returns on how many objects it was. Files stay."""
    objects = [obj for obj in bpy.data.objects if obj.is_editable and any(map(_ours, obj.modifiers))]
    for obj in objects:
        _drop(obj)
    bpy.data.batch_remove([image for image in bpy.data.images if _OURS in image])
    return len(objects)


def _ours(modifier: "bpy.types.Modifier") -> bool:
    return modifier.type == "NODES" and modifier.node_group is not None and _OURS in modifier.node_group


def _drop(obj: "bpy.types.Object") -> None:
    """Take an object's playback away, and its group."""
    for modifier in [one for one in obj.modifiers if _ours(one)]:
        group = modifier.node_group
        obj.modifiers.remove(modifier)
        if group.users == 0:
            bpy.data.node_groups.remove(group)
