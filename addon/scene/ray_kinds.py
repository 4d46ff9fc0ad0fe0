"""What rays are for, and which objects they see."""

from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .scene import SceneObjects


class RayKind(IntEnum):
    """What a ray is for; objects may be hidden from some kinds."""

    DIFFUSE = 0
    GLOSSY = 1
    TRANSMITTED = 2
    SHADOW = 3
    CAMERA = 4


def seen_by(objects: "SceneObjects", kind: RayKind) -> np.ndarray:
    """Which objects rays of a kind see, (o,) bool."""
    seen_by_kind = (
        objects.scatters,
        objects.seen_in_gloss,
        objects.seen_through_glass,
        objects.casts_shadow,
        objects.seen_by_camera,
    )
    return seen_by_kind[kind]
