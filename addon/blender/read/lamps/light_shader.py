"""What the shaders of lamps and worlds emit where it is the same everywhere, and what of it differs."""

from dataclasses import dataclass

import bpy
import numpy as np

from ..materials.expressions import constant
from ..materials.nodes import Place, reached_nodes

_POWERS = {"Quadratic": 0, "Linear": 1, "Constant": 2}
"""Of the distance, with which each output of a Light Falloff node multiplies what falls off by 1/d²."""

_BY_DIRECTION = {("NEW_GEOMETRY", "Incoming"), ("TEX_COORD", "Reflection"), ("TEX_COORD", "Camera")}
_BY_FACING = {"LAYER_WEIGHT", "FRESNEL", "CAMERA"}
_BY_PLACE = {("NEW_GEOMETRY", "Position"), ("NEW_GEOMETRY", "Parametric"), ("TEX_COORD", "Generated")}
_BY_PLACE |= {("TEX_COORD", "UV"), ("TEX_COORD", "Object"), ("TEX_COORD", "Window")}
_BY_NORMAL = {("NEW_GEOMETRY", "Normal"), ("NEW_GEOMETRY", "True Normal"), ("TEX_COORD", "Normal")}


@dataclass(frozen=True)
class Falloff:
    """How a lamp's light falls off, as in `Lights`: `distance_power`, and `smoothing`, m².

    `known` is false where nodes say different things of it.
    """

    distance_power: int = 0
    smoothing: float = 0.0
    known: bool = True


def falloff_of(light: "bpy.types.Light") -> Falloff:
    """What the Light Falloff nodes of a lamp say, as factors of all of its light."""
    said = set()
    for node in reached_nodes(light):
        if node.type == "LIGHT_FALLOFF":
            smooth = constant(Place(node.inputs["Smooth"]))
            smoothing = 0.0 if smooth is None else max(float(smooth[0]), 0.0)
            linked = [_POWERS[output.identifier] for output in node.outputs if output.is_linked]
            said |= {Falloff(power, smoothing, smooth is not None) for power in linked}
        elif node.type == "LIGHT_PATH" and node.outputs["Ray Length"].is_linked:
            said.add(Falloff(known=False))
    return said.pop() if len(said) == 1 else Falloff(known=not said)


def differs_by(light: "bpy.types.Light", sphere: bool) -> set[str]:
    """Of what the nodes of an area lamp or a sphere ask: "direction", "place", or both.

    The normal tells places of a sphere. An IES profile without a vector is by the direction, as Cycles has it.
    """
    asked, by_place = set(), _BY_PLACE | (_BY_NORMAL if sphere else set())
    for node in reached_nodes(light):
        linked = {(node.type, output.identifier) for output in node.outputs if output.is_linked}
        profile = node.type == "TEX_IES" and not node.inputs["Vector"].is_linked
        if linked & _BY_DIRECTION or node.type in _BY_FACING or profile:
            asked.add("direction")
        if linked & by_place or node.type == "UVMAP" or _takes_places(node):
            asked.add("place")
    return asked


def _takes_places(node: "bpy.types.Node") -> bool:
    """Whether a texture is without coordinates, for which it takes those of the surface."""
    vector = node.inputs.get("Vector")
    return node.type.startswith("TEX_") and node.type != "TEX_IES" and vector is not None and not vector.is_linked


def constant_emission(surface: Place) -> np.ndarray | None:
    """Colour × strength of a lamp's or world's shader, (3,) float64, or None where it is not the same everywhere.

    It may be negative, and takes light away then.

    Parameters
    ----------
    surface : Place
        The output node's input.
    """
    place = surface.origin
    kind = place.socket.node.type
    if place.socket.type != "SHADER":  # a colour in a shader's place is light, as Cycles has it
        return _color(place)
    if not place.socket.is_output:
        return np.zeros(3)
    if kind in {"BACKGROUND", "EMISSION"}:
        color, strength = _color(place.input("Color")), constant(place.input("Strength"))
        return None if color is None or strength is None else color * float(strength[0])
    if kind == "ADD_SHADER":
        weights = {"Shader": 1.0, "Shader_001": 1.0}
    elif kind == "MIX_SHADER" and (share := constant(place.input("Fac"))) is not None:
        second = min(max(float(share[0]), 0.0), 1.0)
        weights = {"Shader": 1 - second, "Shader_001": second}
    else:
        return None
    total = np.zeros(3)
    for name, weight in weights.items():
        part = constant_emission(place.input(name)) if weight > 0 else total
        if part is None:
            return None
        total = total + weight * part
    return total


def _color(place: Place) -> np.ndarray | None:
    """A constant colour, (3,) float64, that of a Blackbody node too."""
    value = constant(place)
    if value is None and place.origin.socket.node.type == "BLACKBODY":
        temperature = constant(place.origin.input("Temperature"))
        return None if temperature is None else blackbody(float(temperature[0]))
    return None if value is None else value.astype(np.float64) * np.ones(3)


def blackbody(temperature: float) -> np.ndarray:
    """Colour of a black body at a temperature in K as Cycles has it, (3,) float64."""
    light = bpy.data.lights.new("Photon Bake", "POINT")
    light.use_temperature, light.temperature = True, temperature
    color = np.array(light.temperature_color)
    bpy.data.lights.remove(light)
    return np.maximum(color, 0)
