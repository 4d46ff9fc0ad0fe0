"""Blender's lamps in radiometric units, as Cycles renders them.

With power P (W) × colour × 2^exposure × the temperature's colour as Φ, and s_x, s_y, s_z the lengths of the columns of
the lamp's world matrix:

- point and spot: intensity Φ / 4π; without Normalize Φ r², and Φ / π where the radius r is 0. Scale changes neither.
- spot: a scale that is not uniform widens or narrows the cone, tan → tan · s_xy / s_z.
- sun: irradiance Φ; without Normalize Φ π sin²(angle / 2), and Φ where the angle is 0.
- area: radiance Φ / (π · area), the area as scaled in the world; without Normalize Φ / π.

These were measured with Cycles 4.5 and 5.2 and are held by tests/host/test_extract_lamps.py.
"""

from math import atan, cos, pi, sin, tan

import bpy
import numpy as np

from ..scene import LightKind, Lights
from .nodes import number, surface_node, uses_nodes, vector
from .warn import Warnings


def read_lamp(obj: "bpy.types.Object", matrix: np.ndarray, name: str, warnings: Warnings) -> Lights:
    """One lamp.

    Parameters
    ----------
    obj : bpy.types.Object
        Evaluated object of type LIGHT.
    matrix : (4, 4) float64
        Its world matrix.
    name : str
        For messages.
    warnings : Warnings

    Returns
    -------
    Lights
        One lamp, or none if diffuse surfaces never see its light.
    """
    light = obj.data
    if not obj.visible_diffuse or getattr(getattr(light, "cycles", None), "is_portal", False):
        return Lights.none()
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    power = _power(light, name, warnings)
    _warn_of_rest(obj, light, name, warnings)
    if light.type == "AREA":
        return _area(light, power, matrix, lengths, name, warnings)
    if light.type == "SUN":
        widen = pi * sin(light.angle / 2) ** 2 if light.angle > 0 and not _normalized(light) else 1.0
        return _one(name, LightKind.SUN, power * widen, matrix, angle=light.angle)
    radius = light.shadow_soft_size
    emission = power / (4 * pi) if _normalized(light) else power * (radius**2 if radius > 0 else 1 / pi)
    if light.type == "SPOT":
        angle = _cone(light.spot_size, lengths, name, warnings)
        return _one(name, LightKind.SPOT, emission, matrix, radius=radius, angle=angle, blend=light.spot_blend)
    return _one(name, LightKind.POINT, emission, matrix, radius=radius)


def _power(light: "bpy.types.Light", name: str, warnings: Warnings) -> np.ndarray:
    """Φ of the formulas above, (3,) float64."""
    power = np.array(light.color, np.float64) * light.energy * 2.0 ** getattr(light, "exposure", 0.0)
    if getattr(light, "use_temperature", False):
        power *= np.array(light.temperature_color)
    if uses_nodes(light):
        power *= _node_factor(light, name, warnings)
    return np.maximum(power, 0)


def _node_factor(light: "bpy.types.Light", name: str, warnings: Warnings) -> np.ndarray:
    """What the lamp's nodes multiply its power by, (3,) float64."""
    node = surface_node(light)
    if node is None:
        return np.zeros(3)
    if node.type == "EMISSION":
        color, strength = vector(node.inputs["Color"]), number(node.inputs["Strength"])
        if color is not None and strength is not None:
            return color * strength
    warnings.add(f"Light '{name}': its nodes cannot be read yet, so its own colour and power are baked.")
    return np.ones(3)


def _normalized(light: "bpy.types.Light") -> bool:
    return bool(getattr(light, "normalize", True))


def _warn_of_rest(obj: "bpy.types.Object", light: "bpy.types.Light", name: str, warnings: Warnings) -> None:
    """Say what a lamp does that a bake does not do yet."""
    if not light.use_shadow:
        warnings.add(f"Light '{name}': it casts no shadow in Cycles, but does in this version's bake.")
    linking = getattr(obj, "light_linking", None)
    if linking and (linking.receiver_collection or linking.blocker_collection):
        warnings.add(f"Light '{name}': light linking cannot be baked yet; it shines on everything.")


def _cone(angle: float, lengths: np.ndarray, name: str, warnings: Warnings) -> float:
    """Full opening angle of a spot in the world, rad."""
    across, along = (lengths[0] + lengths[1]) / 2, lengths[2]
    if abs(lengths[0] - lengths[1]) > 0.01 * across:
        warnings.add(f"Light '{name}': its cone is elliptical by its scale and is baked as a round one.")
    if along <= 0 or abs(across - along) <= 1e-5 * along:
        return angle
    return 2 * atan(tan(angle / 2) * across / along)


def _area(
    light: "bpy.types.AreaLight",
    power: np.ndarray,
    matrix: np.ndarray,
    lengths: np.ndarray,
    name: str,
    warnings: Warnings,
) -> Lights:
    square = light.shape in {"SQUARE", "DISK"}
    size = np.array([light.size, light.size if square else light.size_y]) * lengths[:2]
    rectangle = light.shape in {"SQUARE", "RECTANGLE"}
    area = size.prod() * (1.0 if rectangle else pi / 4)
    if area <= 0:
        warnings.add(f"Light '{name}': it has no area, so it gives no light; give it a size and a scale.")
        return Lights.none()
    if cos(light.spread / 2) > 1e-3:
        warnings.add(f"Light '{name}': its spread cannot be baked yet; it shines to all of its front side.")
    kind = LightKind.RECTANGLE if rectangle else LightKind.ELLIPSE
    return _one(name, kind, power / (pi * (area if _normalized(light) else 1.0)), matrix, size=size)


def _one(
    name: str,
    kind: LightKind,
    emission: np.ndarray,
    matrix: np.ndarray,
    size: np.ndarray | tuple[float, float] = (0.0, 0.0),
    radius: float = 0.0,
    angle: float = 0.0,
    blend: float = 0.0,
) -> Lights:
    axis_x, axis_y, direction = _frame(matrix)
    return Lights(
        names=(name,),
        kind=np.array([kind], np.int32),
        emission=np.array([emission], np.float32),
        position=np.array([matrix[:3, 3]], np.float32),
        axis_x=np.array([axis_x], np.float32),
        axis_y=np.array([axis_y], np.float32),
        direction=np.array([direction], np.float32),
        size=np.array([size], np.float32),
        radius=np.array([radius], np.float32),
        angle=np.array([angle], np.float32),
        blend=np.array([blend], np.float32),
    )


def _frame(matrix: np.ndarray) -> list[np.ndarray]:
    """Unit x and y axes and the direction −z of a lamp; a column that scale makes 0 falls back to the world's axis."""
    axes = []
    for i, sign in enumerate((1.0, 1.0, -1.0)):
        column = matrix[:3, i]
        length = np.linalg.norm(column)
        axes.append(sign * (column / length if length > 0 else np.eye(3)[i]))
    return axes
