"""Which rays see the objects of a dependency graph; whether they are shown at all is up to the graph."""

import bpy

from .render_graph import is_stand_in

RAYS = ("diffuse", "shadow", "glossy", "transmission", "camera")
"""The kinds of rays that an object may be hidden from, in Blender's words. Masks have a bit each, from the lowest."""

ALL_RAYS, LIGHT_RAYS = 0b11111, 0b01111
"""Masks of all, and of those that light goes along: what the camera alone sees, lights nothing."""

VOLUMES = {"VOLUME"}
"""Types of objects, and of what geometry nodes make, that have an inside alone."""

HAIR_OR_POINTS = {"CURVES", "POINTCLOUD"}
"""Types of those that light meets but that store none."""

_CAMERA = 1 << RAYS.index("camera")


def rays_that_see(obj: "bpy.types.Object", view_layer: "bpy.types.ViewLayer") -> int:
    """Mask of the `RAYS` that see an evaluated object, or what it instances.

    Parameters
    ----------
    obj : bpy.types.Object
    view_layer : bpy.types.ViewLayer
        Whose collections may be indirect only: the camera does not see what is in them.
    """
    mask = sum(getattr(obj, f"visible_{ray}") << bit for bit, ray in enumerate(RAYS))
    return mask & ~_CAMERA if obj.original.indirect_only_get(view_layer=view_layer) else mask


def objects_of(view_layer: "bpy.types.ViewLayer") -> "list[bpy.types.Object]":
    """A view layer's objects, without those that a missing library leaves empty places of."""
    return [obj for obj in view_layer.objects if obj is not None and not is_stand_in(obj)]


def shown_objects(depsgraph: "bpy.types.Depsgraph") -> "list[bpy.types.Object]":
    """The original objects that a graph shows themselves, and not only what they instance; without its set's."""
    own = set(objects_of(depsgraph.view_layer))
    shown = (one.object.original for one in depsgraph.object_instances if not one.is_instance and one.show_self)
    return [obj for obj in dict.fromkeys(shown) if obj in own]


def rendered_objects(view_layer: "bpy.types.ViewLayer") -> "list[bpy.types.Object]":
    """A view layer's objects that renders show, as far as switches tell; asks no graph, so that it is quick."""
    found: dict[bpy.types.Object, None] = {}
    collections = [view_layer.layer_collection]
    while collections:
        one = collections.pop()
        if not one.exclude and not one.collection.hide_render:
            found |= dict.fromkeys(obj for obj in one.collection.objects if obj is not None and not obj.hide_render)
            collections += one.children
    return [obj for obj in found if not is_stand_in(obj)]
