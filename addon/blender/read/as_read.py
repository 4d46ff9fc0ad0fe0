"""What becomes of objects while a bake runs: each is found again by the id that it has for the session.

No reference into Blender's data is kept, as undo replaces them all.
"""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import blake2b

import bpy
import numpy as np

from .visibility import objects_of

_STILL = 1e-5
"""How far an entry of a world matrix may be from what it was, m: some constraints never settle."""


@dataclass(frozen=True)
class AsRead:
    """A mesh object as it was when the bake read it.

    Attributes
    ----------
    name : str
        Its full name then.
    uid, mesh_uid : int
        Ids for the session, which renaming and undo leave alone.
    faces, positions : bytes
        Digests of which vertices its stored mesh's corners have, and of where these are.
    """

    name: str
    uid: int
    mesh_uid: int
    faces: bytes
    positions: bytes

    @staticmethod
    def of(obj: "bpy.types.Object") -> "AsRead":
        return AsRead(obj.name_full, obj.session_uid, obj.data.session_uid, *_digests(obj.data))


def _digests(mesh: "bpy.types.Mesh") -> tuple[bytes, bytes]:
    """Of a stored mesh: which vertices its corners have, and where its vertices are.

    In edit mode, which hides a mesh's attributes, they are what was last taken over from the mode.
    """
    corners, starts = np.empty(len(mesh.loops), np.int32), np.empty(len(mesh.polygons), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    mesh.polygons.foreach_get("loop_start", starts)
    positions = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", positions.reshape(-1))
    faces = blake2b(corners.data, digest_size=16)
    faces.update(starts.data)
    faces.update(len(positions).to_bytes(8, "little"))
    return faces.digest(), blake2b(positions.data, digest_size=16).digest()


def still_there(meanwhile: Sequence[AsRead]) -> "tuple[list[bpy.types.Object | None], list[str]]":
    """The objects as they are now, None for those that can take their light no more, and sentences about what changed.

    A mesh whose vertices were moved alone still takes it.
    """
    by_uid = {obj.session_uid: obj for obj in bpy.data.objects}
    found: list[bpy.types.Object | None] = []
    warnings, moved = [], []
    for one in meanwhile:
        obj = by_uid.get(one.uid)
        now = AsRead.of(obj) if obj is not None and obj.type == "MESH" else None
        if now is None or (now.mesh_uid, now.faces) != (one.mesh_uid, one.faces):
            problem = "it was deleted" if obj is None else "its mesh was changed"
            warnings.append(f"Object '{one.name}' got no light, since {problem} during the bake: bake again.")
            obj = None
        elif now.positions != one.positions:
            moved.append(now.name)
        found.append(obj)
    if moved:
        warnings.append(f"Vertices of {named(moved)} were moved during the bake, whose light is older: bake again.")
    return found, warnings


class Placement:
    """Where a view layer's objects stood when the bake read them."""

    def __init__(self, view_layer: "bpy.types.ViewLayer") -> None:
        self._matrices = dict(_matrices(objects_of(view_layer)))

    def moved(self, view_layer: "bpy.types.ViewLayer") -> list[str]:
        """Names of the objects that stand elsewhere now; those that are gone are not among them."""
        now = [obj for obj in objects_of(view_layer) if obj.session_uid in self._matrices]
        if not now:
            return []
        before = np.array([self._matrices[obj.session_uid] for obj in now])
        after = np.array([matrix for _, matrix in _matrices(now)])
        apart = ~np.isclose(before, after, rtol=1e-5, atol=_STILL).all(axis=(1, 2))
        return [obj.name_full for obj, moved in zip(now, apart, strict=True) if moved]


def _matrices(objects: "Iterable[bpy.types.Object]") -> "Iterator[tuple[int, list[list[float]]]]":
    return ((obj.session_uid, [list(row) for row in obj.matrix_world]) for obj in objects)


def named(names: Sequence[str]) -> str:
    """Up to five names, as people list them."""
    quoted = [f"'{name}'" for name in names[:5]]
    return ("object " if len(names) == 1 else "objects ") + ", ".join(quoted) + (", …" if len(names) > 5 else "")


@contextmanager
def edit_mode_left() -> Iterator[None]:
    """Leave edit mode, in which Blender would overwrite what is written to meshes, and come back to it at the end."""
    view_layer = bpy.context.view_layer
    editing = [obj for obj in objects_of(view_layer) if obj.mode == "EDIT" and obj.type == "MESH"]
    if not editing:
        yield
        return
    chosen = [obj for obj in objects_of(view_layer) if obj.select_get()]
    bpy.ops.object.mode_set(mode="OBJECT")
    try:
        yield
        if not bpy.app.background:  # edit mode's own undo steps know nothing of other meshes
            bpy.ops.ed.undo_push(message="Bake Indirect")
    finally:
        _select(view_layer, editing)  # who is selected is who enters edit mode
        bpy.ops.object.mode_set(mode="EDIT")
        _select(view_layer, chosen)


def _select(view_layer: "bpy.types.ViewLayer", chosen: "list[bpy.types.Object]") -> None:
    for obj in objects_of(view_layer):
        obj.select_set(obj in chosen, view_layer=view_layer)
