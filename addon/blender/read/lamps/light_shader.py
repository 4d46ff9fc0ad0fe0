"""What the shaders of lamps and worlds emit, where it is the same everywhere."""

import bpy
import numpy as np

from ..materials.expressions import constant
from ..materials.nodes import Place


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
