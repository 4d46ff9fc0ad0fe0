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
    """

    surfaces: "LiveSurfaces"
    looks: Looks
    transforms: np.ndarray
    owners: np.ndarray
    gone: set[int] = field(default_factory=set)

    def shown_in(self, space: Any) -> np.ndarray:
        """Which objects a 3D view shows, (o,) bool."""
        hidden = set(self.gone)
        narrowed = space.local_view is not None or space.use_local_collections
        if narrowed or not all(getattr(space, f"show_object_viewport_{kind}") for kind in _FILTERED):
            for obj in objects_of(bpy.context.view_layer):
                if not obj.visible_in_viewport_get(space):
                    hidden.add(obj.session_uid)
        return ~np.isin(self.owners, list(hidden)) if hidden else np.ones(len(self.owners), bool)
