"""Strands of hair curves, as objects have them or geometry nodes make them."""

import bpy
import numpy as np

from ....scene.fibres.strands import MOST_STRANDS, Strands, thinned
from ..meshes.meshes import VALUE_OF
from ..meshes.object_values import random_of

RADIUS = 0.005
"""Cycles' radius of curves that have no attribute of that name, m."""

ROOT_UV = "surface_uv_coordinate"
"""The attribute of curves in which Cycles finds the texture coordinates of a material that names none."""


def read_curves(curves: "bpy.types.Curves") -> tuple[Strands, int]:
    """Strands of evaluated hair curves, and how many of them there were; where they are too many, some are thicker."""
    start = np.zeros(len(curves.curves) + 1, np.int32)
    if len(start) > 1:
        curves.curve_offset_data.foreach_get("value", start)
    positions, radii = np.zeros((len(curves.points), 3), np.float32), np.full(len(curves.points), RADIUS, np.float32)
    at, thickness = curves.attributes.get("position"), curves.attributes.get("radius")
    if at is not None and len(at.data):
        at.data.foreach_get("vector", positions.ravel())
    if thickness is not None and thickness.data_type == "FLOAT":
        values = np.empty(len(thickness.data), np.float32)
        thickness.data.foreach_get("value", values)
        radii = values if thickness.domain == "POINT" else np.repeat(values, np.diff(start))
    n = len(start) - 1
    chosen = thinned(n, MOST_STRANDS)
    strands = Strands(positions, radii, start.astype(np.int64), _uvs(curves), random_numbers(n))
    return thicker(strands.take(chosen), n), n


def thicker(strands: Strands, n: int) -> Strands:
    """Strands that stand for n: as much thicker as there are more of those."""
    radii = strands.radii * np.float32(n / max(len(strands), 1))
    return Strands(strands.positions, radii, strands.start, strands.uvs, strands.random)


def random_numbers(n: int) -> np.ndarray:
    """Hair Info's random numbers of n strands."""
    return np.asarray(random_of(np.arange(n)), np.float32)


def _uvs(curves: "bpy.types.Curves") -> dict[str, np.ndarray]:
    """Attributes of curves that can be texture coordinates, (s, 2) each."""
    found = {}
    for one in curves.attributes:
        if one.domain == "CURVE" and one.data_type in VALUE_OF:
            prop, width = VALUE_OF[one.data_type]
            values = np.empty((len(one.data), width), np.float32)
            one.data.foreach_get(prop, values.reshape(-1))
            values = np.nan_to_num(values, posinf=0.0, neginf=0.0)
            found[one.name] = values[:, :2] if width > 1 else np.repeat(values, 2, axis=1)
    if ROOT_UV in found:
        found[""] = found[ROOT_UV]
    return found
