"""Surfaces that are drawn, and what else is known of the scene that they are of."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from ..read.visibility import objects_of
from .looks import Looks

if TYPE_CHECKING:
    from ...pipeline.live import LiveSurfaces


_FILTERED = ("mesh", "curve", "surf", "meta", "font", "curves", "pointcloud")
"""Types of objects that a 3D view may leave out, as its settings name them."""

_OUTLINED = {"WIRE", "BOUNDS"}
"""How objects are displayed whose surfaces Solid shading does not draw, such as those that cut holes into others."""


@dataclass
class Stage:
    """Surfaces, and what else is known of the scene that they are of.

    Attributes
    ----------
    surfaces : LiveSurfaces
    looks : Looks
    transforms : (o, 4, 4) float32
        From where the surfaces have each object to where it is.
    owners : (o,) int64
        Session ids by which views show objects or hide them.
    gone : set of int
        Of them, those that the scene does not show any more.
    edited : set of int
        Those whose mesh is edited and another one now, or was so: they are as Solid shading has them.
    outlined : set of int or None
        Objects of the view layer that are displayed without their surfaces; None where that is to be looked up.
    """

    surfaces: "LiveSurfaces"
    looks: Looks
    transforms: np.ndarray
    owners: np.ndarray
    gone: set[int] = field(default_factory=set)
    edited: set[int] = field(default_factory=set)
    outlined: set[int] | None = None

    def note(self, edited: set[int]) -> None:
        """Blender has evaluated something: meshes that are edited are others now."""
        self.edited |= edited
        self.outlined = None

    def shown_in(self, space: Any) -> np.ndarray:
        """Which objects a 3D view shows the surfaces of, (o,) bool."""
        narrowed = space.local_view is not None or space.use_local_collections
        narrowed = narrowed or not all(getattr(space, f"show_object_viewport_{kind}") for kind in _FILTERED)
        if self.outlined is None or narrowed:
            objects = objects_of(bpy.context.view_layer)
            self.outlined = {obj.session_uid for obj in objects if obj.display_type in _OUTLINED}
        hidden = self.gone | self.edited | self.outlined
        if narrowed:
            hidden |= {obj.session_uid for obj in objects if not obj.visible_in_viewport_get(space)}
        return ~np.isin(self.owners, list(hidden)) if hidden else np.ones(len(self.owners), bool)
