"""Which objects a bake writes to."""

from collections.abc import Callable

import bpy

from ...core.errors import BakeError
from ..overrides import without_excluded
from ..warn import Warnings
from .meshes.vertex_meshes import check_target
from .visibility import objects_of, shown_objects

Check = Callable[["bpy.types.Object", "bpy.types.Depsgraph"], None]


def bake_objects(
    depsgraph: "bpy.types.Depsgraph",
    names: list[str] | None = None,
    warnings: list[str] | None = None,
    check: Check = check_target,
    candidates: "list[bpy.types.Object] | None" = None,
) -> "list[bpy.types.Object]":
    """The original mesh objects to bake; those that are excluded by their own settings are not among them.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        The objects that it shows are meant.
    names : list of str, optional
        Objects asked for; each that cannot be baked to is an error. Without names, every mesh object that it shows is
        baked, and those that cannot be are left out with a warning.
    warnings : list of str, optional
        Sentences about objects left out are appended.
    check : callable
        Raises a `BakeError` for an object that cannot be baked to; by default for one whose vertices cannot.
    candidates : list of bpy.types.Object, optional
        Those that are tried without names; by default the mesh objects that renders show.

    Raises
    ------
    BakeError
        If there is nothing to bake, a name is not an object's, or an object asked for cannot be baked to.
    """
    warn = Warnings(warnings)
    if names is not None:
        return _named(depsgraph, names, check, warn)
    if candidates is None:
        candidates = [obj for obj in shown_objects(depsgraph) if obj.type == "MESH"]
    if not candidates:
        raise BakeError("Nothing to bake: the scene has no mesh object that renders show.")
    chosen, refusals = [], []
    for obj in _without_excluded(candidates, warn):
        try:
            check(obj, depsgraph)
        except BakeError as error:
            refusals.append(str(error))
        else:
            chosen.append(obj)
    if not chosen:
        raise BakeError(f"Nothing to bake: {refusals[0]}")
    for sentence in refusals:
        warn.add(f"Left out: {sentence}")
    return chosen


def _without_excluded(objects: "list[bpy.types.Object]", warnings: Warnings) -> "list[bpy.types.Object]":
    there = without_excluded(objects, warnings)
    if not there:
        raise BakeError("Nothing to bake: all objects are excluded by their own settings (Object > Exclude).")
    return there


def _named(
    depsgraph: "bpy.types.Depsgraph", names: list[str], check: Check, warnings: Warnings
) -> "list[bpy.types.Object]":
    shown = {obj.name: obj for obj in shown_objects(depsgraph)}
    there_are = {obj.name for obj in objects_of(depsgraph.view_layer)}
    objects = []
    for name in dict.fromkeys(names):
        if name not in there_are:
            raise BakeError(f"There is no object '{name}' in the view layer: check the name.")
        if name not in shown:
            raise BakeError(f"Object '{name}' is hidden in renders: show it there to bake to it.")
        objects.append(shown[name])
    if not objects:
        raise BakeError("Nothing to bake: no object was named.")
    there = _without_excluded(objects, warnings)
    for obj in there:
        check(obj, depsgraph)
    return there
