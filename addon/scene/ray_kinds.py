"""What rays are for, and which objects they see."""

from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .scene import SceneObjects


class RayKind(IntEnum):
    """What a ray is for; objects may be hidden from some kinds.

    A GATHER ray is a diffuse one that leaves a receiver: what it meets differs by depth alone from what others meet.
    """

    DIFFUSE = 0
    GLOSSY = 1
    TRANSMITTED = 2
    SHADOW = 3
    CAMERA = 4
    GATHER = 5


def seen_by(objects: "SceneObjects", kind: RayKind) -> np.ndarray:
    """Which objects rays of a kind see, (o,) bool."""
    seen_by_kind = (
        objects.scatters,
        objects.seen_in_gloss,
        objects.seen_through_glass,
        objects.casts_shadow,
        objects.seen_by_camera,
        objects.scatters,
    )
    return seen_by_kind[kind]
