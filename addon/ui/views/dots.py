"""Points in space as dots in the 3D viewport."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from ...core.inspector import ViewPoints

_BRIGHTEST = 98
"""The percentile of the light that is shown in full brightness."""


@dataclass
class Dots:
    """A view's points, sent to the graphics card when they are first drawn.

    Attributes
    ----------
    points : ViewPoints
    size : float, pixels
    through : bool
        Whether surfaces do not hide them.
    colour : tuple of float
        sRGB, of points that have no light.
    """

    points: ViewPoints
    size: float
    through: bool = False
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)

    def draw(self) -> None:
        """Draw into what Blender draws at the moment, as it is looked at."""
        gpu.state.point_size_set(self.size)
        gpu.state.depth_test_set("NONE" if self.through else "LESS_EQUAL")
        self._batch.draw(self._shader)
        gpu.state.depth_test_set("NONE")
        gpu.state.point_size_set(1)

    @cached_property
    def _shader(self) -> Any:
        return gpu.shader.from_builtin("POINT_FLAT_COLOR")

    @cached_property
    def _batch(self) -> Any:
        """The dots on the graphics card."""
        light = self.points.light
        rgba = np.ones((len(self.points.position), 4), np.float32)
        rgba[:, :3] = self.colour if light is None else display_colours(light)
        return batch_for_shader(self._shader, "POINTS", {"pos": self.points.position, "color": rgba})


def display_colours(light: np.ndarray) -> np.ndarray:
    """Light (n, 3) of any unit as sRGB colours in [0, 1], (n, 3) float32; the brightest have a channel at 1."""
    if len(light) == 0:
        return light
    full = max(float(np.percentile(light.max(axis=1), _BRIGHTEST)), 1e-30)
    return (np.clip(light / full, 0, 1) ** (1 / 2.2)).astype(np.float32)
