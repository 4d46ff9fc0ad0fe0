"""Which objects a render shows.

A dependency graph of the viewport leaves out what is hidden in the viewport, and shows what is hidden from renders.
The second is put right here. The first cannot be: Python can evaluate no other graph without a render, so objects that
a render would show but that are hidden in the viewport are left out of the bake, and a warning names them.
"""

from dataclasses import dataclass
from functools import cached_property

import bpy

from .warn import Warnings

RAYS = ("diffuse", "shadow", "glossy", "transmission")
"""The kinds of rays that an object may be hidden from, in Blender's words. Masks have a bit each, from the lowest."""


@dataclass(frozen=True)
class ObjectVisibility:
    """What all instances of an object, or all that it instances, have in common.

    Attributes
    ----------
    original : bpy.types.Object
    shown : bool
        Renders show it, or what it instances.
    itself : bool
        Renders show its own geometry.
    instances_collection : bool
        It is an instance of a collection, and shows what renders show of the collection.
    rays : int
        Mask of the `RAYS` that see it.
    """

    original: "bpy.types.Object"
    shown: bool
    itself: bool
    instances_collection: bool
    rays: int

    @cached_property
    def in_collection(self) -> bool:
        """Whether renders show it in instances of its collections."""
        homes = self.original.users_collection
        hidden = bool(homes) and all(home.hide_render for home in homes)
        return not self.original.hide_render and not hidden

    def rays_through(self, parent: "ObjectVisibility | None") -> int | None:
        """Mask of the `RAYS` that see an instance made by `parent`; None where renders do not show it at all."""
        if parent is None or parent.original == self.original:
            return self.rays if self.itself else None
        # A collection's instance shows what renders show of the collection; points and particles show even the
        # instances of an object that is hidden itself.
        if not parent.shown or (parent.instances_collection and not self.in_collection):
            return None
        return self.rays & parent.rays


class RenderVisibility:
    """What a render of a dependency graph's view layer shows.

    Parameters
    ----------
    view_layer : bpy.types.ViewLayer
        The original one, not its evaluated copy.
    """

    def __init__(self, view_layer: "bpy.types.ViewLayer") -> None:
        self._in_view_layer = _render_visible(view_layer.layer_collection)

    def shows(self, obj: "bpy.types.Object") -> bool:
        """Whether renders show an original object of the view layer."""
        return not obj.hide_render and obj.as_pointer() in self._in_view_layer

    def of(self, obj: "bpy.types.Object") -> ObjectVisibility:
        """The visibility of an evaluated object."""
        shown = self.shows(obj.original)
        instancer = obj.is_instancer or len(obj.particle_systems) > 0
        return ObjectVisibility(
            original=obj.original,
            shown=shown,
            itself=shown and (not instancer or obj.show_instancer_for_render),
            instances_collection=obj.original.instance_type == "COLLECTION",
            rays=sum(getattr(obj, f"visible_{ray}") << bit for bit, ray in enumerate(RAYS)),
        )

    def warn_of_missing(self, view_layer: "bpy.types.ViewLayer", warnings: Warnings) -> None:
        """Name the objects that renders show and the viewport hides."""
        kinds = {"MESH", "LIGHT", "CURVE", "SURFACE", "FONT", "META", "EMPTY"}
        objects = [
            obj
            for obj in view_layer.objects
            if obj.type in kinds and self.shows(obj) and hidden_in_viewport(obj, view_layer)
        ]
        objects = [obj for obj in objects if obj.type != "EMPTY" or obj.is_instancer]
        if objects:
            names = ", ".join(f"'{obj.name}'" for obj in objects[:5]) + (", …" if len(objects) > 5 else "")
            warnings.add(
                f"{len(objects)} object(s) that renders show are hidden in the viewport and were left out of the "
                f"bake ({names}): show them in the viewport to bake with them."
            )


def hidden_in_viewport(obj: "bpy.types.Object", view_layer: "bpy.types.ViewLayer") -> bool:
    """Whether a view layer's viewport, and so its dependency graph, leaves an object out."""
    return not obj.visible_get(view_layer=view_layer)


def _render_visible(root: "bpy.types.LayerCollection") -> set[int]:
    """Pointers of the objects in collections that renders show."""
    found: set[int] = set()
    stack = [root]
    while stack:
        layer = stack.pop()
        if layer.collection.hide_render:
            continue
        if not layer.exclude:
            found.update(obj.as_pointer() for obj in layer.collection.objects)
        stack.extend(layer.children)
    return found
