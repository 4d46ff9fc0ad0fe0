"""Baked copies: mesh objects that have light of their own where no stored mesh can hold it.

Texts, curves, metaballs, instances, meshes that several objects share, and geometry that modifiers make anew: renders
show each as one evaluated mesh or several. A copy has such a mesh as its own, with the light, and takes the place of
the original in renders. `remove_copies` takes all copies away and shows the originals as before.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import pi
from typing import Any

import bpy
import numpy as np

from ...receivers import Receivers
from ..read.as_read import AsRead
from ..read.meshes.meshes import corner_vertex
from ..read.meshes.shown_meshes import CopyMesh, meshes_of
from ..read.render_graph import in_render_graph
from .color_attribute import write_color, write_color_attribute

_COLLECTION, _SUFFIX = "Photon Bake", " (Baked)"
_ORIGINAL = "photon_bake_original"
"""Custom property of a copy: the object that it stands for; of our collection: that it is ours."""

HIDE_RENDER = "photon_bake_hide_render"
"""Custom property of an original: whether it was hidden in renders before."""

_INDEX = "photon_bake_index"
"""Custom property of a copy: which of the meshes that the original shows it has."""

_LOOKS = (
    *("color", "pass_index", "display_type", "is_holdout", "is_shadow_catcher", "lightgroup"),
    *(f"visible_{ray}" for ray in ("camera", "diffuse", "glossy", "shadow", "transmission", "volume_scatter")),
)
"""What a copy has in common with its original, beside custom properties and light linking."""


def write_light(
    irradiance_value: np.ndarray,
    receivers: Receivers,
    copies: list[CopyMesh],
    attribute_name: str,
    meanwhile: Sequence[AsRead],
    apart: Mapping[str, np.ndarray] | None = None,
) -> list[str]:
    """Write E / π to a color attribute of stored meshes and of new copies.

    The copies take the place of their originals, and of earlier copies of these. What was changed meanwhile is left
    out.

    Parameters
    ----------
    irradiance_value : (n, 3) float32, W/m²
        See `write_color_attribute`.
    receivers : Receivers
        Their last targets are the copies.
    copies : list of CopyMesh
    attribute_name : str
    meanwhile : sequence of AsRead
        The object of each other target.
    apart : dict of str to (n, 3) float32, W/m²
        Parts of the light that get attributes of their own, by their names.

    Returns
    -------
    list of str
        Warnings.

    Raises
    ------
    BakeError
        If a value is not finite, or nothing can take light. Nothing was written then.
    """
    targets = receivers.targets
    n_own = len(targets) - len(copies)
    made, warnings = make_meshes({(copy.owner, copy.index): copy.mesh.corner_vertex for copy in copies})
    lights = {**(apart or {}), attribute_name: irradiance_value}  # the last one becomes the active color
    try:
        if n_own or not made:
            own = replace(receivers, targets=targets[:n_own])
            for name, values in lights.items():
                warnings += write_color_attribute(values, own, name, meanwhile)
    except BaseException:
        drop_meshes(made.values())
        raise
    for copy, target in zip(copies, targets[n_own:], strict=True):
        for name, values in lights.items() if (copy.owner, copy.index) in made else ():
            colors = np.asarray(values, np.float32) / np.float32(pi)
            rgba = np.insert(target.values(colors), 3, 1, axis=1)
            write_color(made[copy.owner, copy.index].mesh, name, target.domain, rgba)
    place_copies(list(made.values()))
    return warnings


@dataclass(frozen=True)
class MadeMesh:
    """A new mesh for a copy of mesh `index` that `owner` shows, and where it stands, a 4 × 4 matrix."""

    owner: "bpy.types.Object"
    index: int
    mesh: "bpy.types.Mesh"
    matrix: Any


def place_copies(made: list[MadeMesh]) -> "list[bpy.types.Object]":
    """Put new meshes into the scene in the place of the originals and of earlier copies; returns the new objects.

    What other light an earlier copy has is kept where its faces are the same.
    """
    owners = list(dict.fromkeys(one.owner for one in made))
    earlier = [copy for copy in _copies() if copy[_ORIGINAL] in owners]
    by_place = {(copy[_ORIGINAL], copy.get(_INDEX)): copy for copy in earlier}
    placed = []
    for one in made:
        obj = _new_copy(one)
        before = by_place.get((one.owner, one.index))
        if before is not None and np.array_equal(corner_vertex(before.data), corner_vertex(one.mesh)):
            _keep_light(obj, before)
        _collection(_home(one.owner)[0]).objects.link(obj)
        placed.append(obj)
    _remove(earlier)
    for obj, one in zip(placed, made, strict=True):
        obj.name = obj.data.name = one.owner.name + _SUFFIX
    for owner in owners:
        if HIDE_RENDER not in owner:
            owner[HIDE_RENDER] = owner.hide_render
        owner.hide_render = True
    return placed


def complete_copies(owners: Collection[str]) -> None:
    """Give copies of some originals what other light these show beside theirs: colors, UV maps, custom properties.

    That is light of the same bake, for which the original would have needed no copy.
    """
    copies = {(copy[_ORIGINAL], copy.get(_INDEX)): copy for copy in _copies() if copy[_ORIGINAL] is not None}
    there = [owner for owner in dict.fromkeys(owner for owner, _ in copies) if owner.name in owners]

    def complete(depsgraph: "bpy.types.Depsgraph") -> None:
        for owner, index, instance in meshes_of(there, depsgraph):
            copy, obj = copies.get((owner, index)), instance.object
            if copy is None or obj.original != owner:
                continue
            if np.array_equal(corner_vertex(copy.data), corner_vertex(obj.data)):
                _keep_light(copy, obj)

    if there:
        with originals_shown():
            in_render_graph(*_home(there[0]), complete)


def drop_meshes(made: Collection[MadeMesh]) -> None:
    """Take new meshes away that get no place."""
    bpy.data.batch_remove([one.mesh for one in made])


def _keep_light(obj: "bpy.types.Object", before: "bpy.types.Object") -> None:
    """Give a new copy the colors, UV maps and custom properties that an earlier one has beside its own."""
    mesh = obj.data
    for layer in before.data.uv_layers:
        if layer.name not in mesh.uv_layers:
            uv = np.empty(2 * len(mesh.loops), np.float32)
            layer.uv.foreach_get("vector", uv)
            new = mesh.uv_layers.new(name=layer.name, do_init=False)
            if new is not None:  # there may be no more than eight
                new.uv.foreach_set("vector", uv)
    for color in before.data.color_attributes:
        if color.name not in mesh.attributes:
            values = np.empty(4 * len(color.data), np.float32)
            color.data.foreach_get("color", values)
            mesh.color_attributes.new(color.name, color.data_type, color.domain).data.foreach_set("color", values)
    for name, value in before.items():
        if name not in obj and name != HIDE_RENDER and not hasattr(value, "to_dict"):
            obj[name] = value


def _home(obj: "bpy.types.Object") -> "tuple[bpy.types.Scene, bpy.types.ViewLayer]":
    """A scene and view layer that show an original object: the current ones, if they do."""
    scene, view_layer = bpy.context.scene, bpy.context.view_layer
    if scene not in obj.users_scene:
        scene = next(iter(obj.users_scene), scene)
        view_layer = scene.view_layers[0]
    return scene, view_layer


def make_meshes(
    wanted: Mapping[tuple[str, int], np.ndarray],
) -> tuple[dict[tuple[str, int], MadeMesh], list[str]]:
    """New meshes for copies, and sentences about owners that show others now and get none.

    Parameters
    ----------
    wanted : mapping
        By owner and index the vertex of each corner, (c,) int32, that the mesh had when it was read.
    """
    owners = {name: bpy.data.objects.get((name, None)) for name, _ in wanted}
    there = [owner for owner in owners.values() if owner is not None]
    made: dict[tuple[str, int], MadeMesh] = {}

    def make(depsgraph: "bpy.types.Depsgraph") -> None:
        for owner, index, instance in meshes_of(there, depsgraph):
            place, obj = (owner.name, index), instance.object
            if place in wanted and np.array_equal(corner_vertex(obj.data), wanted[place]):
                mesh = _new_mesh(owner, instance, depsgraph)
                _take_object_materials(mesh, obj)
                made[place] = MadeMesh(owner, index, mesh, instance.matrix_world.copy())

    if there:
        with originals_shown():
            in_render_graph(*_home(there[0]), make)
    changed = {owner for owner, index in wanted if (owner, index) not in made}
    drop_meshes([made.pop(place) for place in list(made) if place[0] in changed])
    return made, [
        f"Object '{name}' got no light, since its mesh was changed during the bake: bake again."
        for name in sorted(changed)
    ]


def _new_mesh(owner: "bpy.types.Object", instance: Any, depsgraph: "bpy.types.Depsgraph") -> "bpy.types.Mesh":
    """A new mesh from an evaluated one."""
    obj = instance.object
    if not instance.is_instance or obj.original != owner or owner.type != "MESH":
        return bpy.data.meshes.new_from_object(obj, preserve_all_data_layers=True, depsgraph=depsgraph)
    mesh = obj.data.copy()  # of what nodes instance without another object, Blender would make its owner's own mesh
    for name in [one.name for one in mesh.attributes if one.name.startswith(".a_")]:  # anonymous ones
        mesh.attributes.remove(mesh.attributes[name])
    return mesh


def _new_copy(made: MadeMesh) -> "bpy.types.Object":
    obj = bpy.data.objects.new(made.owner.name + _SUFFIX, made.mesh)
    _take_looks(obj, made.owner)
    obj[_ORIGINAL], obj[_INDEX] = made.owner, made.index
    _place(obj, made.matrix)
    return obj


def has_copies() -> bool:
    """Whether the file has baked copies."""
    return next(_copies(), None) is not None


def remove_copies() -> int:
    """Take all copies away and show their originals as before; returns how many copies there were."""
    copies = list(_copies())
    _remove(copies)
    for owner in _originals():
        owner.hide_render = bool(owner[HIDE_RENDER])
        del owner[HIDE_RENDER]
    bpy.data.batch_remove([one for one in bpy.data.collections if _ORIGINAL in one and not one.all_objects])
    return len(copies)


@contextmanager
def originals_shown() -> Iterator[None]:
    """Show the originals in renders and hide their copies, for a while."""
    hidden = {obj: obj.hide_render for obj in (*_originals(), *_copies())}
    for obj in hidden:
        obj.hide_render = bool(obj.get(HIDE_RENDER, True))
    try:
        yield
    finally:
        for obj, before in hidden.items():
            obj.hide_render = before


def _take_object_materials(mesh: "bpy.types.Mesh", obj: "bpy.types.Object") -> None:
    """Give a new mesh the materials that an evaluated object has in its own slots."""
    for i, slot in enumerate(obj.material_slots):
        if slot.link == "OBJECT" and i < len(mesh.materials):
            mesh.materials[i] = slot.material.original if slot.material else None


def _take_looks(obj: "bpy.types.Object", owner: "bpy.types.Object") -> None:
    for name in _LOOKS:
        setattr(obj, name, getattr(owner, name))
    for name in ("receiver_collection", "blocker_collection"):
        setattr(obj.light_linking, name, getattr(owner.light_linking, name))
    for name, value in owner.items():
        if name != HIDE_RENDER and not hasattr(value, "to_dict"):  # groups are settings of add-ons
            obj[name] = value


def _place(obj: "bpy.types.Object", matrix: Any) -> None:
    """Put an object where a matrix says; what location, rotation and scale cannot say goes into the mesh."""
    obj.matrix_basis = matrix
    if not np.allclose(obj.matrix_basis, matrix, rtol=1e-5, atol=1e-6 * np.abs(matrix).max()):
        obj.data.transform(matrix)
        obj.matrix_basis.identity()


def _collection(scene: "bpy.types.Scene") -> "bpy.types.Collection":
    """The scene's collection of copies, made where it is missing."""
    for collection in scene.collection.children_recursive:
        if _ORIGINAL in collection:
            return collection
    collection = bpy.data.collections.new(_COLLECTION)
    collection[_ORIGINAL] = True
    scene.collection.children.link(collection)
    return collection


def _copies() -> "Iterator[bpy.types.Object]":
    return (obj for obj in bpy.data.objects if _ORIGINAL in obj)


def _originals() -> "list[bpy.types.Object]":
    return [obj for obj in bpy.data.objects if HIDE_RENDER in obj]


def _remove(copies: "list[bpy.types.Object]") -> None:
    meshes = {copy.data for copy in copies}
    bpy.data.batch_remove(copies)
    bpy.data.batch_remove([mesh for mesh in meshes if not mesh.users])
