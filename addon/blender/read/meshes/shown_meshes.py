"""What objects show in renders, their own mesh or those that they instance, and which have light in copies alone."""

from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ....core.errors import BakeError
from ....receivers import ReceiverMesh
from ...warn import Warnings, listed
from ..hair.particles import hair_systems
from ..visibility import HAIR_OR_POINTS, VOLUMES, objects_of
from .meshes import evaluated_mesh
from .vertex_meshes import check_placed, evaluated_receiver_mesh

MAX_COPIES = 1000
"""Of one object's instances; more of them, and it stays as it is, with a warning."""

_LOST = {"LIGHT", *HAIR_OR_POINTS, *VOLUMES}
"""Types of what would be lost with an original that a copy of meshes stands for."""


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
        shown = found.setdefault(owner, Shown(all_meshes=not any(hair_systems(owner))))
        obj = instance.object
        # What curves are made into comes as an instance too, and what nodes instance may have no other object.
        shown.instances |= instance.is_instance and (obj.original != owner or owner.type == "MESH")
        shown.all_meshes &= obj.type not in _LOST
        shown.n_meshes += _has_faces(obj, depsgraph)
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
    for owner, index, instance in meshes_of(owners, depsgraph):
        obj, matrix = instance.object, np.array(instance.matrix_world, np.float64)
        try:
            mesh = evaluated_receiver_mesh(obj.name, obj.data.name, evaluated_mesh(obj, depsgraph), matrix)
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
    shown: "dict[bpy.types.Object, Shown]", names: list[str] | None, warn: Warnings, shared: bool = True
) -> "list[bpy.types.Object]":
    """Those objects, of some names or all, that can have light of their own in copies alone.

    They are not meshes, show instances, have a mesh that is linked from another file, or if `shared` share theirs.
    """
    shown = {obj: what for obj, what in shown.items() if what.n_meshes and (names is None or obj.name in names)}
    users = Counter(obj.data for obj in shown if obj.type == "MESH")
    chosen = []
    for obj, what in shown.items():
        if obj.type == "MESH" and not what.instances and (users[obj.data] < 2 or not shared) and obj.data.is_editable:
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


def _instances(depsgraph: "bpy.types.Depsgraph") -> "Iterator[tuple[bpy.types.Object, Any]]":
    """What renders show, and by which original object; each holds until the next."""
    own = set(objects_of(depsgraph.view_layer))  # and not of its Background Set
    for instance in depsgraph.object_instances:
        if instance.show_self:
            owner = (instance.parent or instance.object).original
            if owner in own:
                yield owner, instance


def meshes_of(
    owners: "Collection[bpy.types.Object]", depsgraph: "bpy.types.Depsgraph"
) -> "Iterator[tuple[bpy.types.Object, int, Any]]":
    """The instances that are meshes with faces, and which of their owner's they are."""
    n_found = dict.fromkeys(owners, 0)
    for owner, instance in _instances(depsgraph):
        if owner in n_found and _has_faces(instance.object, depsgraph):
            yield owner, n_found[owner], instance
            n_found[owner] += 1


def _has_faces(obj: "bpy.types.Object", depsgraph: "bpy.types.Depsgraph") -> bool:
    return obj.type == "MESH" and len(evaluated_mesh(obj, depsgraph).polygons) > 0
