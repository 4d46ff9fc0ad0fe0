"""Baked copies: mesh objects that have light of their own where no stored mesh can hold it.

Texts, curves, metaballs, instances, meshes that several objects share, and geometry that modifiers make anew: renders
show each as one evaluated mesh or several. A copy has such a mesh as its own, with the light, and takes the place of
the original in renders. `remove_copies` takes all copies away and shows the originals as before.
"""

from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import pi
from typing import Any

import bpy
import numpy as np

from ..errors import BakeError
from ..receivers import ReceiverMesh, Receivers
from .as_read import AsRead
from .color_attribute import write_color, write_color_attribute
from .meshes import corner_vertex
from .render_graph import in_render_graph
from .vertex_meshes import check_placed, evaluated_receiver_mesh
from .visibility import NOT_READ, has_hair, objects_of
from .warn import Warnings, listed

MAX_COPIES = 1000
"""Of one object's instances; more of them, and it stays as it is, with a warning."""

_COLLECTION, _SUFFIX = "Photon Bake", " (Baked)"
_ORIGINAL = "photon_bake_original"
"""Custom property of a copy: the object that it stands for; of our collection: that it is ours."""

_HIDE_RENDER = "photon_bake_hide_render"
"""Custom property of an original: whether it was hidden in renders before."""

_LOST = {"LIGHT", *NOT_READ}
"""Types of what would be lost with an original that a copy of meshes stands for."""

_LOOKS = (
    *("color", "pass_index", "display_type", "is_holdout", "is_shadow_catcher", "lightgroup"),
    *(f"visible_{ray}" for ray in ("camera", "diffuse", "glossy", "shadow", "transmission", "volume_scatter")),
)
"""What a copy has in common with its original, beside custom properties and light linking."""


@dataclass(frozen=True)
class CopyMesh:
    """An evaluated mesh that a copy is made of.

    Attributes
    ----------
    owner : str
        The original object that shows it: itself, or the one that instances it.
    index : int
        Which of the meshes that the owner shows.
    mesh : ReceiverMesh
    """

    owner: str
    index: int
    mesh: ReceiverMesh


@dataclass
class Shown:
    """What an original object shows in renders.

    Attributes
    ----------
    n_meshes : int
        With faces; its own and those that it instances.
    instances : bool
        Whether one of these is an instance.
    all_meshes : bool
        Whether it shows nothing of the types `_LOST`, and no hair.
    """

    n_meshes: int = 0
    instances: bool = False
    all_meshes: bool = True


def shown_meshes(depsgraph: "bpy.types.Depsgraph") -> "dict[bpy.types.Object, Shown]":
    """The original objects of a graph that show something in renders, themselves or by instances."""
    found: dict[bpy.types.Object, Shown] = {}
    for owner, instance in _instances(depsgraph):
        shown = found.setdefault(owner, Shown(all_meshes=not has_hair(owner)))
        obj = instance.object
        # What curves are made into comes as an instance too, and what nodes instance may have no other object.
        shown.instances |= instance.is_instance and (obj.original != owner or owner.type == "MESH")
        shown.all_meshes &= obj.type not in _LOST
        shown.n_meshes += obj.type == "MESH" and len(obj.data.polygons) > 0
    return found


def read_copies(
    owners: "Collection[bpy.types.Object]",
    depsgraph: "bpy.types.Depsgraph",
    warn: Warnings,
    all_of_them: bool = True,
) -> list[CopyMesh]:
    """The meshes with faces that some original objects show in renders.

    Parameters
    ----------
    all_of_them : bool
        Whether a mesh that is not finite is an error, or is left out with a warning.

    Raises
    ------
    BakeError
    """
    copies = []
    for owner, index, instance in _meshes(owners, depsgraph):
        obj, matrix = instance.object, np.array(instance.matrix_world, np.float64)
        try:
            mesh = evaluated_receiver_mesh(obj.name, obj.data.name, obj.data, matrix)
        except BakeError as error:
            if all_of_them:
                raise
            warn.add(f"Left out: {error}")
        else:
            copies.append(CopyMesh(owner.name, index, mesh))
    return copies


def warn_of_shared_light(shown: "dict[bpy.types.Object, Shown]", warn: Warnings) -> None:
    """Name the objects that have no light of their own without copies."""
    others = [f"'{obj.name}'" for obj, what in shown.items() if obj.type != "MESH" and what.n_meshes]
    instancers = [f"'{obj.name}'" for obj, what in shown.items() if what.instances and what.n_meshes]
    no_meshes = [name for name in others if name not in instancers]
    if no_meshes:
        warn.add(
            f"{len(no_meshes)} object(s) are not meshes and got no light ({listed(no_meshes)}): turn on Bake Copies, "
            "or convert them (Object > Convert)."
        )
    if instancers:
        warn.add(
            f"{len(instancers)} object(s) show instances, which have the light of the objects that they are made of "
            f"({listed(instancers)}): turn on Bake Copies for light of their own."
        )


def check_copied(obj: "bpy.types.Object", depsgraph: "bpy.types.Depsgraph") -> None:
    """Make sure that copies can take the place of an original object.

    Raises
    ------
    BakeError
        If not, naming the object and what to do.
    """
    if not obj.is_editable:
        raise BakeError(
            f"Object '{obj.name}' is linked from another file, so no copy can take its place: make it local (Object > "
            "Relations > Make Local)."
        )
    check_placed(obj, depsgraph)


def copyable(
    shown: "dict[bpy.types.Object, Shown]", names: list[str] | None, warn: Warnings
) -> "list[bpy.types.Object]":
    """Those objects, of some names or all, that can have light of their own in copies alone.

    They are not meshes, show instances, share their mesh, or have one that is linked from another file.
    """
    shown = {obj: what for obj, what in shown.items() if what.n_meshes and (names is None or obj.name in names)}
    users = Counter(obj.data for obj in shown if obj.type == "MESH")
    chosen = []
    for obj, what in shown.items():
        if obj.type == "MESH" and not what.instances and users[obj.data] < 2 and obj.data.is_editable:
            continue
        if what.n_meshes > MAX_COPIES:
            warn.add(
                f"Object '{obj.name}' shows {what.n_meshes:,} instances, too many to copy: they keep the light of the "
                "objects that they are made of."
            )
        elif not what.all_meshes:
            warn.add(
                f"Object '{obj.name}' shows more than meshes (lamps, hair, volumes), which copies cannot: it keeps the "
                "light that it shares."
            )
        else:
            chosen.append(obj)
    return chosen


def write_light(
    irradiance_value: np.ndarray,
    receivers: Receivers,
    copies: list[CopyMesh],
    attribute_name: str,
    meanwhile: Sequence[AsRead],
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
    made, warnings = _make_meshes(copies)
    try:
        if n_own or not made:
            own = replace(receivers, targets=targets[:n_own])
            warnings += write_color_attribute(irradiance_value, own, attribute_name, meanwhile)
    except BaseException:
        bpy.data.batch_remove([one.mesh for one in made.values()])
        raise
    colors = np.asarray(irradiance_value, np.float32) / np.float32(pi)
    for copy, target in zip(copies, targets[n_own:], strict=True):
        if (copy.owner, copy.index) in made:
            values = np.insert(target.values(colors), 3, 1, axis=1)
            write_color(made[copy.owner, copy.index].mesh, attribute_name, target.domain, values)
    _place_copies(list(made.values()))
    return warnings


@dataclass(frozen=True)
class _Made:
    """A mesh for a copy of what `owner` shows, and where it stands, a 4 × 4 matrix."""

    owner: "bpy.types.Object"
    mesh: "bpy.types.Mesh"
    matrix: Any


def _place_copies(made: list[_Made]) -> None:
    """Put new meshes into the scene in the place of the originals."""
    owners = list(dict.fromkeys(one.owner for one in made))
    _remove([copy for copy in _copies() if copy[_ORIGINAL] in owners])
    for one in made:
        _collection(_home(one.owner)[0]).objects.link(_new_copy(one.owner, one.mesh, one.matrix))
    for owner in owners:
        if _HIDE_RENDER not in owner:
            owner[_HIDE_RENDER] = owner.hide_render
        owner.hide_render = True


def _home(obj: "bpy.types.Object") -> "tuple[bpy.types.Scene, bpy.types.ViewLayer]":
    """A scene and view layer that show an original object: the current ones, if they do."""
    scene, view_layer = bpy.context.scene, bpy.context.view_layer
    if scene not in obj.users_scene:
        scene = next(iter(obj.users_scene), scene)
        view_layer = scene.view_layers[0]
    return scene, view_layer


def _make_meshes(copies: list[CopyMesh]) -> tuple[dict[tuple[str, int], _Made], list[str]]:
    """New meshes for copies by owner and index, and sentences about owners that show others now and get none."""
    wanted = {(copy.owner, copy.index): copy.mesh for copy in copies}
    owners = {name: bpy.data.objects.get((name, None)) for name, _ in wanted}
    there = [owner for owner in owners.values() if owner is not None]
    made: dict[tuple[str, int], _Made] = {}

    def make(depsgraph: "bpy.types.Depsgraph") -> None:
        for owner, index, instance in _meshes(there, depsgraph):
            place, obj = (owner.name, index), instance.object
            if place in wanted and np.array_equal(corner_vertex(obj.data), wanted[place].corner_vertex):
                mesh = _new_mesh(owner, instance, depsgraph)
                _take_object_materials(mesh, obj)
                made[place] = _Made(owner, mesh, instance.matrix_world.copy())

    if there:
        with originals_shown():
            in_render_graph(*_home(there[0]), make)
    changed = {owner for owner, index in wanted if (owner, index) not in made}
    bpy.data.batch_remove([made.pop(place).mesh for place in list(made) if place[0] in changed])
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


def _new_copy(owner: "bpy.types.Object", mesh: "bpy.types.Mesh", matrix: Any) -> "bpy.types.Object":
    mesh.name = owner.name + _SUFFIX
    obj = bpy.data.objects.new(owner.name + _SUFFIX, mesh)
    _take_looks(obj, owner)
    obj[_ORIGINAL] = owner
    _place(obj, matrix)
    return obj


def has_copies() -> bool:
    """Whether the file has baked copies."""
    return next(_copies(), None) is not None


def remove_copies() -> int:
    """Take all copies away and show their originals as before; returns how many copies there were."""
    copies = list(_copies())
    _remove(copies)
    for owner in _originals():
        owner.hide_render = bool(owner[_HIDE_RENDER])
        del owner[_HIDE_RENDER]
    bpy.data.batch_remove([one for one in bpy.data.collections if _ORIGINAL in one and not one.all_objects])
    return len(copies)


@contextmanager
def originals_shown() -> Iterator[None]:
    """Show the originals in renders and hide their copies, for a while."""
    hidden = {obj: obj.hide_render for obj in (*_originals(), *_copies())}
    for obj in hidden:
        obj.hide_render = bool(obj.get(_HIDE_RENDER, True))
    try:
        yield
    finally:
        for obj, before in hidden.items():
            obj.hide_render = before


def _instances(depsgraph: "bpy.types.Depsgraph") -> "Iterator[tuple[bpy.types.Object, Any]]":
    """What renders show, and by which original object; each holds until the next."""
    own = set(objects_of(depsgraph.view_layer))  # and not of its Background Set
    for instance in depsgraph.object_instances:
        if instance.show_self:
            owner = (instance.parent or instance.object).original
            if owner in own:
                yield owner, instance


def _meshes(
    owners: "Collection[bpy.types.Object]", depsgraph: "bpy.types.Depsgraph"
) -> "Iterator[tuple[bpy.types.Object, int, Any]]":
    """The instances that are meshes with faces, and which of their owner's they are."""
    n_found = dict.fromkeys(owners, 0)
    for owner, instance in _instances(depsgraph):
        if owner in n_found and instance.object.type == "MESH" and len(instance.object.data.polygons):
            yield owner, n_found[owner], instance
            n_found[owner] += 1


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
        if name != _HIDE_RENDER and not hasattr(value, "to_dict"):  # groups are settings of add-ons
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
    return [obj for obj in bpy.data.objects if _HIDE_RENDER in obj]


def _remove(copies: "list[bpy.types.Object]") -> None:
    meshes = {copy.data for copy in copies}
    bpy.data.batch_remove(copies)
    bpy.data.batch_remove([mesh for mesh in meshes if not mesh.users])
