"""Blender's lamps in radiometric units, as Cycles renders them.

With power P (W) × colour × 2^exposure × the temperature's colour as Φ, and s_x, s_y, s_z the lengths of the columns of
the lamp's world matrix:

- point and spot: intensity Φ / 4π; without Normalize Φ r², and Φ / π where the radius r is 0. Scale changes neither.
- spot: its cone is as wide as one scaled by s_x / s_z along x and s_y / s_z along y.
- sun: irradiance Φ; without Normalize Φ π sin²(angle / 2), and Φ where the angle is 0.
- area: radiance Φ / (π · area), the area as scaled in the world; without Normalize Φ / π. A spread does not change the
  power.

Nodes multiply Φ: by a constant; or by a pattern over directions or places, and by a fall-off (`lamp_nodes`).

Negative power takes light away. Max Bounces are read as Cycles has them: surfaces between the lamp and who looks.

Surfaces scatter a lamp's light by the lobes that Ray Visibility says; rays meet no lamp without Multiple Importance.

These were measured with Cycles 4.5 and 5.2 and are held by tests/host/test_extract_lamps.py.
"""

from dataclasses import dataclass, replace
from math import pi, sin

import bpy
import numpy as np

from ....core.errors import Advice
from ....scene import ALL_BOUNCES, LightKind, Lights
from ...warn import Warnings
from ..materials.nodes import Place, output_node, uses_nodes
from .lamp_nodes import LampNodes, falling_off
from .light_shader import constant_emission


@dataclass(frozen=True)
class LampReading:
    """At most one lamp, and what of its light only Cycles can tell, if anything."""

    lights: Lights
    nodes: LampNodes | None = None


def read_lamp(obj: "bpy.types.Object", matrix: np.ndarray, name: str, warnings: Warnings) -> LampReading:
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
    LampReading
        Without a lamp if surfaces never see its light.
    """
    light = obj.data
    cycles, kinds = getattr(light, "cycles", None), ("diffuse", "glossy", "transmission")
    seen = [bool(getattr(obj, f"visible_{kind}")) for kind in kinds]
    if not any(seen) or getattr(cycles, "is_portal", False):
        return LampReading(Lights.none())
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    factor = _node_factor(light)
    power = _power(light) * (1.0 if factor is None else factor)
    lights = _shining(light, power, matrix, lengths, name, warnings)
    met = bool(getattr(cycles, "use_multiple_importance_sampling", True))
    diffuse, glossy, transmitted, of_rays = (np.full(len(lights), one) for one in (*seen, met))
    lights = replace(
        lights,
        seen_by_diffuse=diffuse,
        seen_in_gloss=glossy,
        seen_through_glass=transmitted,
        met_by_rays=of_rays,
        max_bounces=np.full(len(lights), getattr(cycles, "max_bounces", ALL_BOUNCES), np.int32),
    )
    if factor is not None or not len(lights):
        return LampReading(lights)
    return LampReading(falling_off(lights, light, name, warnings), LampNodes.of(light, lights, matrix, name, warnings))


def _shining(
    light: "bpy.types.Light",
    power: np.ndarray,
    matrix: np.ndarray,
    lengths: np.ndarray,
    name: str,
    warnings: Warnings,
) -> Lights:
    """A lamp of any type, as all rays see it."""
    if light.type == "AREA":
        return _area(light, power, matrix, lengths, name, warnings)
    if light.type == "SUN":
        widen = pi * sin(light.angle / 2) ** 2 if light.angle > 0 and not _normalized(light) else 1.0
        return _one(name, LightKind.SUN, power * widen, matrix, angle=light.angle)
    radius = light.shadow_soft_size
    emission = power / (4 * pi) if _normalized(light) else power * (radius**2 if radius > 0 else 1 / pi)
    ball = {"radius": radius, "sphere": radius > 0 and not light.use_soft_falloff}
    if light.type == "SPOT":
        cone = {"angle": light.spot_size, "blend": light.spot_blend, "stretch": _stretch(lengths)}
        return _one(name, LightKind.SPOT, emission, matrix, **ball, **cone)
    return _one(name, LightKind.POINT, emission, matrix, **ball)


def in_light_group(obj: "bpy.types.Object", instancer: "bpy.types.Object | None", light_group: str) -> bool:
    """Whether a lamp or an emitting object belongs to a light group; all belong to the group without a name.

    An instance of an object without a group is in that of the object that instances it.
    """
    return not light_group or light_group_of(obj, instancer) == light_group


def light_group_of(obj: "bpy.types.Object", instancer: "bpy.types.Object | None") -> str:
    """The name of the light group that a lamp or an emitting object is in; empty where it is in none."""
    return str(obj.lightgroup or (instancer.lightgroup if instancer else ""))


def _power(light: "bpy.types.Light") -> np.ndarray:
    """Φ of the formulas above without nodes, (3,) float64."""
    power = np.array(light.color, np.float64) * light.energy * 2.0 ** getattr(light, "exposure", 0.0)
    return power * np.array(light.temperature_color) if getattr(light, "use_temperature", False) else power


def _node_factor(light: "bpy.types.Light") -> np.ndarray | None:
    """What the lamp's nodes multiply its power by, (3,) float64; None where that is not the same everywhere."""
    if not uses_nodes(light):
        return np.ones(3)
    output = output_node(light)
    return np.zeros(3) if output is None else constant_emission(Place(output.inputs["Surface"]))


def _normalized(light: "bpy.types.Light") -> bool:
    return bool(getattr(light, "normalize", True))


def _stretch(lengths: np.ndarray) -> tuple[float, float]:
    """How much wider a spot's cone is along its axes than its angle says."""
    x, y, z = lengths
    return (x / z, y / z) if min(lengths) > 0 else (1.0, 1.0)


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
        warnings.add(Advice(f"Light '{name}': it has no area, so it gives no light; give it a size and a scale."))
        return Lights.none()
    kind = LightKind.RECTANGLE if rectangle else LightKind.ELLIPSE
    radiance = power / (pi * (area if _normalized(light) else 1.0))
    return _one(name, kind, radiance, matrix, size=size, spread=light.spread)


def _one(name: str, kind: LightKind, emission: np.ndarray, matrix: np.ndarray, **columns: object) -> Lights:
    """One lamp; `columns` are those of `Lights` that its kind has."""
    axis_x, axis_y, direction = _frame(matrix)
    place = {"position": matrix[:3, 3], "axis_x": axis_x, "axis_y": axis_y, "direction": direction}
    rows = {"emission": emission, **place, **columns}
    return Lights.of((name,), np.array([kind]), **{column: np.array([row]) for column, row in rows.items()})


def _frame(matrix: np.ndarray) -> list[np.ndarray]:
    """Unit x and y axes and the direction −z of a lamp; a column that scale makes 0 falls back to the world's axis."""
    axes = []
    for i, sign in enumerate((1.0, 1.0, -1.0)):
        column = matrix[:3, i]
        length = np.linalg.norm(column)
        axes.append(sign * (column / length if length > 0 else np.eye(3)[i]))
    return axes
