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
    """

    surfaces: "LiveSurfaces"
    looks: Looks
    transforms: np.ndarray
    owners: np.ndarray
    gone: set[int] = field(default_factory=set)
    edited: set[int] = field(default_factory=set)

    def shown_in(self, space: Any) -> np.ndarray:
        """Which objects a 3D view shows the surfaces of, (o,) bool."""
        narrowed = space.local_view is not None or space.use_local_collections
        narrowed = narrowed or not all(getattr(space, f"show_object_viewport_{kind}") for kind in _FILTERED)
        hidden = self.gone | self.edited
        for obj in objects_of(bpy.context.view_layer):
            if obj.display_type in _OUTLINED or (narrowed and not obj.visible_in_viewport_get(space)):
                hidden.add(obj.session_uid)
        return ~np.isin(self.owners, list(hidden)) if hidden else np.ones(len(self.owners), bool)
