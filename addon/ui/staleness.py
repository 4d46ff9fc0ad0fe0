"""Marks what is said of a bake as out of date once anything that it speaks of has changed."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

from ..blender.read.visibility import rendered_objects
from .state import bake_state

_SETTLED = 0.1
"""Seconds after which Blender has evaluated what an operator changed."""

_NEVER_SEEN = {"ARMATURE", "CAMERA", "LATTICE", "LIGHT_PROBE", "SPEAKER"}
"""Types of objects that are in no light themselves; what they deform is told by itself."""

_own = 0
"""How many changes of our own are under way."""

_there: dict[int, frozenset[int]] = {}
"""Which objects renders showed when a scene was baked, by session ids."""


@contextmanager
def own_changes() -> Iterator[None]:
    """Changes to the scene that leave the light as it is, such as writing or showing it."""
    global _own
    _own += 1
    try:
        yield
        bpy.context.view_layer.update()
    finally:
        if bpy.app.background:
            _end()
        else:  # windows with other view layers evaluate them when they are drawn
            bpy.app.timers.register(_end, first_interval=_SETTLED, persistent=True)


def _end() -> None:
    global _own
    _own = max(_own - 1, 0)


def follow(scene: Any) -> None:
    """Take note of what a scene has at the end of its bake."""
    _there[scene.session_uid] = _objects_of(scene)


@bpy.app.handlers.persistent
def _on_update(scene: Any, depsgraph: Any) -> None:
    if _own or depsgraph.mode == "RENDER":
        return
    outcome = bake_state.outcome_of(scene.session_uid)
    if outcome is None or outcome.stale or not (outcome.places or outcome.files):
        return
    outcome.stale = _changes_light(scene, depsgraph)


def _changes_light(scene: Any, depsgraph: Any) -> bool:
    """Whether an update of a graph may change what light there is, or where."""
    updates = list(depsgraph.updates)
    regrouped = any(isinstance(one.id, bpy.types.Collection) for one in updates)
    camera = scene.camera if "camera" in scene.photon_bake.targets else None
    for one in updates:
        block = one.id.original
        moved = one.is_updated_geometry or one.is_updated_transform
        if isinstance(block, bpy.types.Object):
            seen = block.type not in _NEVER_SEEN or block == camera
            if seen and (moved or (one.is_updated_shading and not regrouped)):
                return True
        elif isinstance(block, bpy.types.Material | bpy.types.World | bpy.types.Light):
            return True
    return regrouped and _there.get(scene.session_uid) != _objects_of(scene)


def _objects_of(scene: Any) -> frozenset[int]:
    return frozenset(obj.session_uid for view_layer in scene.view_layers for obj in rendered_objects(view_layer))


@bpy.app.handlers.persistent
def _on_load(*_: Any) -> None:
    bake_state.forget()
    _there.clear()


def register() -> None:
    """Watch changes, and files that are opened."""
    bpy.app.handlers.depsgraph_update_post.append(_on_update)
    bpy.app.handlers.load_pre.append(_on_load)


def unregister() -> None:
    """Watch no longer."""
    bpy.app.handlers.load_pre.remove(_on_load)
    bpy.app.handlers.depsgraph_update_post.remove(_on_update)
    _there.clear()
    if bpy.app.timers.is_registered(_end):
        bpy.app.timers.unregister(_end)
    _end()
