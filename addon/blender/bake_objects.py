"""Which objects a bake writes to."""

from collections.abc import Callable

import bpy

from ..errors import BakeError
from .vertex_meshes import check_target
from .visibility import RenderVisibility, hidden_in_viewport
from .warn import Warnings

Check = Callable[["bpy.types.Object", "bpy.types.Depsgraph"], None]


def bake_objects(
    depsgraph: "bpy.types.Depsgraph",
    names: list[str] | None = None,
    warnings: list[str] | None = None,
    check: Check = check_target,
    candidates: "list[bpy.types.Object] | None" = None,
) -> "list[bpy.types.Object]":
    """The original mesh objects to bake.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        Its view layer's objects are meant.
    names : list of str, optional
        Objects asked for; each that cannot be baked to is an error. Without names, every mesh object that renders show
        is baked, and those that cannot be are left out with a warning.
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
    if names is not None:
        return _named(depsgraph, names, check)
    warn = Warnings(warnings)
    chosen, refusals = [], []
    for obj in _shown(depsgraph.view_layer) if candidates is None else candidates:
        try:
            check(obj, depsgraph)
        except BakeError as error:
            if obj.mode == "EDIT":
                raise  # the user is at work on it and would be surprised to find it left out
            refusals.append(str(error))
        else:
            chosen.append(obj)
    if not chosen:
        raise BakeError(f"Nothing to bake: {refusals[0] if refusals else 'renders show no mesh with faces.'}")
    for sentence in refusals:
        warn.add(f"Left out: {sentence}")
    return chosen


def _shown(view_layer: "bpy.types.ViewLayer") -> "list[bpy.types.Object]":
    """Mesh objects that a bake sees."""
    visibility = RenderVisibility(view_layer)
    meshes = [
        obj
        for obj in view_layer.objects
        if obj.type == "MESH" and visibility.shows(obj) and not hidden_in_viewport(obj, view_layer)
    ]
    if not meshes:
        raise BakeError("Nothing to bake: the scene has no mesh object that is shown in renders and in the viewport.")
    return meshes


def _named(depsgraph: "bpy.types.Depsgraph", names: list[str], check: Check) -> "list[bpy.types.Object]":
    objects = []
    for name in dict.fromkeys(names):
        obj = depsgraph.view_layer.objects.get(name)
        if obj is None:
            raise BakeError(f"There is no object '{name}' in the view layer: check the name.")
        check(obj, depsgraph)
        objects.append(obj)
    if not objects:
        raise BakeError("Nothing to bake: no object was named.")
    return objects
