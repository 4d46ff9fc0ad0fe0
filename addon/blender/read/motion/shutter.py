"""When the shutter is open, as the scene's render settings have it, and the scene at those times."""

from collections.abc import Iterator
from contextlib import contextmanager

import bpy
import numpy as np

from ....core.errors import BakeError
from ..render_graph import move_to_frame
from .animation_kept import animation_kept

_BEGINS = {"START": 0.0, "CENTER": -0.5, "END": -1.0}
"""Where the shutter opens, as a share of its time, after the frame."""

_CURVE_POINTS = 1024


def shutter_middle(scene: "bpy.types.Scene") -> float:
    """The frame in the middle of the shutter: what does not move is read there, as Cycles does."""
    return _opens(scene) + float(scene.render.motion_blur_shutter) / 2


def shutter_frames(scene: "bpy.types.Scene", n: int) -> list[float]:
    """Frames at the middles of n parts of the shutter's time, through each of which as much light comes.

    Parameters
    ----------
    scene : bpy.types.Scene
        Its Shutter, Position and Shutter Curve, and its current frame.
    """
    curve = scene.render.motion_blur_shutter_curve
    curve.initialize()
    x = (np.arange(_CURVE_POINTS) + 0.5) / _CURVE_POINTS
    weights = np.maximum([curve.evaluate(curve.curves[0], one) for one in x], 0)
    if not weights.any():
        weights[:] = 1
    total = np.concatenate([[0], np.cumsum(weights)]) / weights.sum()
    times = np.interp((np.arange(n) + 0.5) / n, total, np.linspace(0, 1, _CURVE_POINTS + 1))
    return [_opens(scene) + float(scene.render.motion_blur_shutter * time) for time in times]


def _opens(scene: "bpy.types.Scene") -> float:
    """The frame at which the shutter opens."""
    render = scene.render
    return float(scene.frame_current_final + _BEGINS[render.motion_blur_position] * render.motion_blur_shutter)


@contextmanager
def other_times(scene: "bpy.types.Scene") -> Iterator[None]:
    """Within a call of `in_render_graph`, a time in which the graph may be moved: the frame and all that curves animate
    are as they were at the end.
    """
    frame = float(scene.frame_current_final)
    with animation_kept():
        try:
            yield
        finally:
            move_to_frame(frame)


def check_simulations(scene: "bpy.types.Scene") -> None:
    """Refuse simulations that are not baked: what they make of times between frames is not known, and asking for it
    would take what they have from them.

    Raises
    ------
    BakeError
    """
    world, remedy = scene.rigidbody_world, "bake it (Physics > Cache > Bake), or turn Motion Blur off."
    if world is not None and world.collection and len(world.collection.objects) and not world.point_cache.is_baked:
        raise BakeError(f"The cache of the rigid bodies of scene '{scene.name}' is not baked: {remedy}")
    for obj in scene.objects:
        for modifier in obj.modifiers:
            cache = getattr(modifier, "point_cache", None)
            if cache is not None and modifier.show_render and not cache.is_baked:
                raise BakeError(
                    f"The cache of modifier '{modifier.name}' of object '{obj.name}' is not baked: {remedy}"
                )
