"""Instances of an object that look different, in groups that look alike.

A material is held as many times as there are values that it reads; light comes back from the mean of many instances, so
where there are very many the nearest ones share theirs.
"""

from collections.abc import Callable, Iterable, Iterator

import bpy
import numpy as np

from ..visibility import HAIR_OR_POINTS
from .object_values import ObjectValues, Reading, readings_in

MOST_GROUPS, MOST_BAKED_GROUPS = 64, 8
"""How many looks the instances of one object may have; the second where Cycles bakes each of them."""


def groups_of_instances(values: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Instances that look alike: the group of each, (n,), and the values of each group, (g, k) float32.

    Parameters
    ----------
    values : (n, k) float32
    most : int
        Groups. Where there are more values, neighbours in their order share a mean.
    """
    distinct, group = np.unique(values, axis=0, return_inverse=True)
    group = group.reshape(-1)
    if len(distinct) <= most:
        return group, distinct
    group = group * most // len(distinct)
    totals = [np.bincount(group, column, most) for column in values.T]
    return group, (np.stack(totals, axis=1) / np.bincount(group, minlength=most)[:, None]).astype(np.float32)


def alike(
    depsgraph: "bpy.types.Depsgraph", readings_of: "Callable[[bpy.types.Object], tuple[list[Reading], int]]"
) -> "Iterator[tuple[bpy.types.Object, int, dict[int, dict[Reading, np.ndarray]]]]":
    """Which instances have which values, where they differ by instance.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
    readings_of : callable
        What the materials of an evaluated object read that differs by instance, and how many groups it may have.

    Yields
    ------
    original object, how many different values its instances have, values of each of the graph's instances by row
    """
    asked: dict[tuple, tuple[list[Reading], int]] = {}
    found: dict[tuple, tuple[list[int], list[np.ndarray]]] = {}
    for row, instance in enumerate(depsgraph.object_instances):
        obj = instance.object
        if not instance.is_instance or obj.type not in {"MESH", *HAIR_OR_POINTS}:
            continue
        key = (obj.original, obj.data)
        if key not in asked:
            asked[key] = readings_of(obj)
        readings, _ = asked[key]
        if readings:
            of_instance = ObjectValues.of(instance, {})
            rows, values = found.setdefault(key, ([], []))
            rows.append(row)
            values.append(np.concatenate([of_instance(one) for one in readings]))
    for key, (rows, values) in found.items():
        readings, most = asked[key]
        table = np.array(values, np.float32)
        group, of_group = groups_of_instances(table, most)
        shared = [dict(zip(readings, one.reshape(-1, 4), strict=True)) for one in of_group]
        n_values = len(np.unique(table, axis=0)) if len(of_group) == most else len(of_group)
        yield key[0], n_values, {row: shared[g] for row, g in zip(rows, group, strict=True)}


def reads_by_instance(materials: "Iterable[bpy.types.Material]") -> bool:
    """Whether a material reads anything that differs by instance."""
    trees = [material.node_tree for material in materials if material.node_tree]
    return any(reading.differs_by_instance for tree in trees for reading in readings_in(tree))
