"""What updates of a dependency graph say that live light has to follow."""

from dataclasses import dataclass, field
from typing import Any

import bpy

from ..read.visibility import objects_of

_NEVER_SEEN = {"ARMATURE", "CAMERA", "LATTICE", "LIGHT_PROBE", "SPEAKER", "GREASEPENCIL"}
"""Types of objects that are in no light themselves; what they deform is told by itself."""


SURFACELESS = _NEVER_SEEN | {"LIGHT"}
"""Types of objects of whose coming only lamps have to be read."""


@dataclass
class Changes:
    """What has changed since it was last read; sets are of session ids.

    Attributes
    ----------
    lamps, world : bool
    materials : set of int
    moved : set of int
        Objects that stand elsewhere, and what they instance with them.
    reshaped : set of int
        Objects of another shape, of the same faces or of others.
    contents : bool
        Whether there may be other objects than before.
    everything : bool
        Whether more has changed than can be read by itself.
    held : set of int
        Objects whose mesh is edited: what changes of it counts when that ends.
    edited : set of int
        Of them, those that have changed since they were first heard of.
    """

    lamps: bool = False
    world: bool = False
    materials: set[int] = field(default_factory=set)
    moved: set[int] = field(default_factory=set)
    reshaped: set[int] = field(default_factory=set)
    contents: bool = False
    everything: bool = False
    held: set[int] = field(default_factory=set)
    edited: set[int] = field(default_factory=set)

    def __bool__(self) -> bool:
        """Whether there is something to read, besides what is held."""
        some = self.materials or self.moved or self.reshaped
        return bool(self.lamps or self.world or some or self.contents or self.everything)

    def note(self, updates: Any) -> None:
        """Take updates of a dependency graph in, which come in any order and often several times."""
        found = list(updates)
        blocks = [one.id.original for one in found]
        rebuilt = any(isinstance(block, bpy.types.Scene | bpy.types.Collection) for block in blocks)
        self.contents |= rebuilt
        # Objects are told of shading too when a graph is rebuilt, and some when one of their materials changes
        own_shading = not rebuilt and not any(isinstance(block, bpy.types.Material) for block in blocks)
        for update, block in zip(found, blocks, strict=True):
            if isinstance(block, bpy.types.Object):
                self._note_object(update, block, own_shading and update.is_updated_shading)
            elif isinstance(block, bpy.types.Material):
                self.materials.add(block.session_uid)
            elif isinstance(block, bpy.types.Light):
                self.lamps |= _flagged(update)
            elif isinstance(block, bpy.types.World):
                self.world |= _flagged(update)
            elif isinstance(block, bpy.types.Image):
                self.everything = True

    def _note_object(self, update: Any, obj: "bpy.types.Object", shading: bool) -> None:
        if obj.type in _NEVER_SEEN:
            return
        if obj.type == "LIGHT":
            self.lamps |= update.is_updated_geometry or update.is_updated_transform or shading
            return
        if obj.mode == "EDIT":
            if update.is_updated_geometry and obj.session_uid in self.held:  # Blender tells of edit mode's begin, too
                self.edited.add(obj.session_uid)
            self.held.add(obj.session_uid)
        elif update.is_updated_geometry:
            self.reshaped.add(obj.session_uid)
        elif update.is_updated_transform:  # animated objects are told of shading then, too
            self.moved.add(obj.session_uid)
            self.lamps |= obj.type == "EMPTY"  # which may instance lamps
        else:
            self.everything |= shading

    def release(self, view_layer: "bpy.types.ViewLayer") -> None:
        """Let those that are edited no longer count."""
        if self.held:
            editing = {obj.session_uid for obj in objects_of(view_layer) if obj.mode == "EDIT"}
            self.reshaped |= self.held - editing
            self.held &= editing
            self.edited &= editing


def _flagged(update: Any) -> bool:
    return bool(update.is_updated_geometry or update.is_updated_transform or update.is_updated_shading)


def contents_of(scene: "bpy.types.Scene", view_layer: "bpy.types.ViewLayer") -> tuple[Any, ...]:
    """Equal as long as a view layer shows the same objects, with the same world over them."""
    shown = frozenset(obj.session_uid for obj in objects_of(view_layer) if obj.visible_get(view_layer=view_layer))
    blocks = scene.world, view_layer.material_override, getattr(view_layer, "world_override", None)
    return (shown, *(block.session_uid if block else 0 for block in blocks))
