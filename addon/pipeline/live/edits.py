"""Edits of a scene that live light follows."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ...scene import Lights, Materials, Scene, World
from .surfaces import LiveSurfaces


@dataclass(frozen=True)
class LampsChanged:
    """Lamps were moved, changed, added or removed: all lamps that there are now, as `Scene.lights` has them."""

    lights: Lights


@dataclass(frozen=True)
class WorldChanged:
    """The world is another one."""

    world: World


@dataclass(frozen=True)
class MaterialsChanged:
    """Materials look otherwise: all of them, in the rows that the scene's triangles name.

    Where these have other rows or another number of them than before, the scene must be replaced.
    """

    materials: Materials


@dataclass(frozen=True)
class ObjectMoved:
    """An object stands elsewhere, or is turned or scaled.

    Attributes
    ----------
    object : int
        Its number in `Scene.objects`.
    transform : (4, 4) float, m
        What takes it from where the scene has it, which `Live` was given or which `SceneReplaced` brought, to where it
        is now (column vectors; new world matrix × inverse of the old one). The newest counts, whatever came before; the
        identity takes it back.
    """

    object: int
    transform: np.ndarray


@dataclass(frozen=True)
class ObjectReshaped:
    """An object has another shape: the same triangles with their corners elsewhere.

    Where it has others, the scene must be replaced.

    Attributes
    ----------
    object : int
        Its number in `Scene.objects`.
    corners, corner_normals : (t, 3, 3) float32
        Of its triangles in the order of the scene, in world space; `ObjectMoved` counts from there from now on.
    corner_tangents : (t, 3, 3, 3) or (0, 3, 3, 3) float32
        As in `ShadingFrames`.
    surfaces : LiveSurfaces
        Those there were, `reshaped`.
    """

    object: int
    corners: np.ndarray
    corner_normals: np.ndarray
    corner_tangents: np.ndarray
    surfaces: LiveSurfaces


@dataclass(frozen=True)
class ObjectShown:
    """An object is not there any more, or again: hidden, removed, or brought back by an undo."""

    object: int
    shown: bool


@dataclass(frozen=True)
class SceneReplaced:
    """Anything else: all is built anew. What was light before is shown until there is new light."""

    scene: Scene
    surfaces: LiveSurfaces


OfObject: TypeAlias = ObjectMoved | ObjectReshaped | ObjectShown
Edit: TypeAlias = LampsChanged | WorldChanged | MaterialsChanged | OfObject | SceneReplaced


def coalesced(edits: Iterable[Edit]) -> list[Edit]:
    """The edits that still count, in order: the newest of each kind and object since the scene was replaced."""
    newest: dict[object, Edit] = {}
    for edit in edits:
        if isinstance(edit, SceneReplaced):
            newest.clear()
        if isinstance(edit, ObjectReshaped):
            newest.pop((ObjectMoved, edit.object), None)
        key = (type(edit), edit.object if isinstance(edit, OfObject) else 0)
        newest.pop(key, None)
        newest[key] = edit
    return list(newest.values())
