"""The dependency graph that renders evaluate, which Blender gives to no one but render engines.

It has objects that are hidden in the viewport alone, modifiers' render switches and levels, particles' render amounts,
and the Background Set. An engine of our own, which bakes a triangle of our own in a copy of the scene, is handed one.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import floor
from typing import Any, ClassVar, TypeVar

import bpy

from ...core.errors import BakeError
from ...core.parallel import join_cancelled
from ..temporary import Temporary

T = TypeVar("T")

_STAND_IN = "photon_bake_stand_in"  # custom property of the object that the engine bakes


class _Reader(bpy.types.RenderEngine):
    """Hands the graph that it is to bake from to whoever reads it; bakes and renders nothing."""

    bl_idname = "PHOTON_BAKE_READER"
    bl_label = "Photon Bake (reads scenes, renders nothing)"

    readers: ClassVar[list[Callable[[Any], None]]] = []
    """Of the calls that are under way, the innermost last."""

    engines: ClassVar[list[Any]] = []
    """Of those whose graphs are read."""

    def bake(self, depsgraph: Any, obj: Any, pass_type: str, pass_filter: int, width: int, height: int) -> None:
        self.engines.append(self)
        try:
            self.readers[-1](depsgraph)
        finally:
            self.engines.pop()


def in_render_graph(
    scene: "bpy.types.Scene", view_layer: "bpy.types.ViewLayer", work: "Callable[[bpy.types.Depsgraph], T]"
) -> T:
    """What `work` returns for the evaluated graph that a render of a view layer has; for the main thread.

    The graph is of a copy of the scene, which shares its objects and collections, and ends with the call. `work` may
    call this again for another scene, and may have Cycles bake, but not render.

    Parameters
    ----------
    scene : bpy.types.Scene
    view_layer : bpy.types.ViewLayer
        Of the scene.
    work : callable

    Raises
    ------
    BakeError
        If Blender is at another bake.
    """
    results: list[T] = []
    errors: list[BaseException] = []

    def read(depsgraph: "bpy.types.Depsgraph") -> None:
        shown.render.engine = engine  # which `work` may ask for
        try:
            results.append(work(depsgraph))
        except BaseException as error:  # Blender would print it and go on
            errors.append(error)

    join_cancelled()
    simulated = _is_simulated(scene)
    bpy.ops.ed.flush_edits()  # what edit and sculpt modes hold
    with Temporary() as temporary, _registered(read):
        shown = scene if simulated else temporary.add(scene.copy())
        layer, stand_in = shown.view_layers[view_layer.name], _stand_in(temporary)
        shown.collection.objects.link(stand_in)
        engine, shown.render.engine = shown.render.engine, _Reader.bl_idname
        one = [stand_in]
        objects = {
            "object": stand_in,
            "active_object": stand_in,
            "selected_objects": one,
            "selected_editable_objects": one,
        }
        try:
            with bpy.context.temp_override(scene=shown, view_layer=layer, **objects):
                bpy.ops.object.bake(type="EMIT", target="VERTEX_COLORS", use_clear=False, use_selected_to_active=False)
        finally:
            shown.render.engine = engine
    if simulated:
        view_layer.update()  # else it would list the stand-in, which is gone
    if errors:
        raise errors[0]
    if not results:
        raise BakeError("Blender does not evaluate the scene while it bakes or renders: wait for that to end.")
    return results[0]


def move_to_frame(frame: float) -> None:
    """Evaluate the graph of the `in_render_graph` call that is under way at another time, as engines blur motion.

    What was read of the graph is gone then. Blender writes the animated values of that time into the file, so that
    whoever calls this has to put back what was there: `animation_kept`.
    """
    whole = floor(frame)
    _Reader.engines[-1].frame_set(whole, frame - whole)


def is_stand_in(obj: "bpy.types.Object") -> bool:
    """Whether an original object is the one that a graph's engine bakes, and no part of the scene."""
    return _STAND_IN in obj


def _is_simulated(scene: "bpy.types.Scene") -> bool:
    """Whether a copy would lose where things are: rigid bodies that are not baked lie in the scene's own memory."""
    return scene.rigidbody_world is not None and scene.is_editable


def _stand_in(temporary: Temporary) -> "bpy.types.Object":
    """A mesh object that can be baked: one face, without an area, and a colour attribute."""
    mesh = temporary.add(bpy.data.meshes.new("Photon Bake"))
    mesh.from_pydata([(0, 0, 0)] * 3, [], [(0, 1, 2)])
    mesh.color_attributes.new("Photon Bake", "FLOAT_COLOR", "POINT")
    obj = temporary.add(bpy.data.objects.new("Photon Bake", mesh))
    obj[_STAND_IN] = True
    return obj


@contextmanager
def _registered(reader: Callable[[Any], None]) -> Iterator[None]:
    """The engine with a reader, known to Blender for a while: menus would offer it to people."""
    if not _Reader.is_registered:
        bpy.utils.register_class(_Reader)
    _Reader.readers.append(reader)
    try:
        yield
    finally:
        _Reader.readers.pop()
        if not _Reader.readers:
            _unregister_unless_seen()


def unregister() -> None:
    """Take the engine away, if it is still there."""
    if _Reader.is_registered:
        bpy.utils.unregister_class(_Reader)


def _unregister_unless_seen() -> None:
    """Take the engine away, unless that would start anew what a window renders: then a later bake does."""
    renders = any(
        space.shading.type == "RENDERED"
        for window in bpy.context.window_manager.windows
        for area in window.screen.areas
        for space in area.spaces
        if space.type == "VIEW_3D"
    )
    if not renders:
        unregister()
