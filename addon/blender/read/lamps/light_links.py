"""Light and shadow linking: which objects a lamp or an emissive object lights, and which keep its light away."""

from collections.abc import Iterator
from dataclasses import replace

import bpy
import numpy as np

from ....scene import EmitterLinks, Scene

Placed = tuple["bpy.types.Object", "bpy.types.Object | None"]
"""An original object, and the one that instances it."""


def link_lights(scene: Scene, lamps: "list[bpy.types.Object]", objects: list[Placed]) -> Scene:
    """The scene with its lamps and emissive objects linked to its objects as Cycles links them.

    Parameters
    ----------
    scene : Scene
        Its lamps are linked to nothing yet.
    lamps : list of bpy.types.Object
        The original of each of the scene's lamps.
    objects : list of Placed
        The original of each of the scene's objects.
    """
    illuminates = _linked([_receivers(lamp) for lamp in lamps], objects)
    blocked_by = _linked([_blockers(lamp) for lamp in lamps], objects)
    shadowless = np.array([not lamp.data.use_shadow for lamp in lamps], bool)
    if shadowless.any():
        blocked_by = np.ones((len(lamps), len(objects)), bool) if blocked_by is None else blocked_by
        blocked_by[shadowless] = False
    lights = replace(scene.lights, illuminates=illuminates, blocked_by=blocked_by)
    return replace(scene, lights=lights, objects=replace(scene.objects, links=_links_of_emitters(scene, objects)))


def _links_of_emitters(scene: Scene, objects: list[Placed]) -> EmitterLinks | None:
    """What the emissive objects of a scene light; None where all light all."""
    glows = scene.materials.emits[scene.material_of_triangle]
    of_pair: dict[tuple, int] = {}
    group = np.full(len(objects), -1, np.int32)
    for index in np.unique(scene.object_of_triangle[glows]):
        pair = _receivers(objects[index][0]), _blockers(objects[index][0])
        if any(pair):
            group[index] = of_pair.setdefault(pair, len(of_pair))
    if not of_pair:
        return None
    everything = np.ones((len(of_pair), len(objects)), bool)
    linked = (_linked([pair[k] for pair in of_pair], objects) for k in (0, 1))
    return EmitterLinks(group, *(everything if rows is None else rows for rows in linked))


def _receivers(obj: "bpy.types.Object") -> "bpy.types.Collection | None":
    linking = getattr(obj, "light_linking", None)
    return linking.receiver_collection if linking else None


def _blockers(obj: "bpy.types.Object") -> "bpy.types.Collection | None":
    linking = getattr(obj, "light_linking", None)
    return linking.blocker_collection if linking else None


def _linked(collections: "list[bpy.types.Collection | None]", objects: list[Placed]) -> np.ndarray | None:
    """Which objects each collection links, (l, o) bool; all, where there is no collection. None without any.

    Where a collection includes some objects it links no others, and never those that it excludes. What is said of an
    object that instances others goes before what is said of them.
    """
    states = {collection: dict(_states(collection)) for collection in collections if collection}
    if not states:
        return None
    mentioned = set().union(*states.values())
    sought = [instancer if instancer in mentioned else obj for obj, instancer in objects]
    rows = {collection: _row(said, sought) for collection, said in states.items()}
    everything = np.ones(len(objects), bool)
    return np.stack([rows.get(collection, everything) for collection in collections])


def _row(said: "dict[bpy.types.Object, str]", sought: "list[bpy.types.Object]") -> np.ndarray:
    """Which objects are linked by what is said of some, (o,) bool."""
    default = "EXCLUDE" if "INCLUDE" in said.values() else "INCLUDE"
    return np.array([said.get(obj, default) == "INCLUDE" for obj in sought], bool)


def _states(collection: "bpy.types.Collection") -> "Iterator[tuple[bpy.types.Object, str]]":
    """Each object that a collection says something of, and what; what comes later counts."""
    for child, entry in zip(collection.children, collection.collection_children, strict=False):
        for obj in child.all_objects:
            yield obj, entry.light_linking.link_state
    for obj, entry in zip(collection.objects, collection.collection_objects, strict=False):
        yield obj, entry.light_linking.link_state
