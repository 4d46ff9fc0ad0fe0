"""Which objects a render shows.

A dependency graph of the viewport leaves out what is hidden in the viewport, and shows what is hidden from renders.
The second is put right here. The first cannot be: Python can evaluate no other graph without a render, so objects that
a render would show but that are hidden in the viewport are left out of the bake, and a warning names them.
"""

import bpy

from .warn import Warnings


class RenderVisibility:
    """What a render of a dependency graph's view layer shows.

    Parameters
    ----------
    view_layer : bpy.types.ViewLayer
        The original one, not its evaluated copy.
    """

    def __init__(self, view_layer: "bpy.types.ViewLayer") -> None:
        self._in_view_layer = _render_visible(view_layer.layer_collection)
        self._known: dict[int, bool] = {}

    def shows(self, obj: "bpy.types.Object") -> bool:
        """Whether renders show an original object of the view layer."""
        return not obj.hide_render and obj.as_pointer() in self._in_view_layer

    def shows_instance(self, instance: "bpy.types.DepsgraphObjectInstance") -> bool:
        """Whether renders show what a dependency graph's iterator is at."""
        obj = instance.object
        parent = instance.parent
        if instance.is_instance and parent is not None and parent.original != obj.original:
            # A collection's instance shows what renders show of the collection; points and particles show even the
            # instances of an object that is hidden itself.
            of_collection = parent.original.instance_type == "COLLECTION"
            return self.shows(parent.original) and (not of_collection or self._shows_in_collection(obj.original))
        if obj.is_instancer or len(obj.particle_systems):
            return self.shows(obj.original) and obj.show_instancer_for_render
        return self.shows(obj.original)

    def _shows_in_collection(self, obj: "bpy.types.Object") -> bool:
        key = obj.as_pointer()
        if key not in self._known:
            homes = obj.users_collection
            hidden = bool(homes) and all(home.hide_render for home in homes)
            self._known[key] = not obj.hide_render and not hidden
        return self._known[key]

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
