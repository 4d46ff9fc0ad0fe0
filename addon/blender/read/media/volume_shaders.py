"""The medium that a material or a world fills space with: what its Volume says, where it is the same everywhere."""

from collections.abc import Callable, Iterator

import bpy
import numpy as np

from ....scene import Medium
from ..materials.closures import Closure, read_closures
from ..materials.expressions import constant
from ..materials.nodes import Place, output_node, source, uses_nodes

Parts = tuple[np.ndarray, np.ndarray]
"""Coefficients of absorption and scattering, (3,) each, 1/m."""

_HENYEY_GREENSTEIN = "HENYEY_GREENSTEIN"
_DENSEST = 1e9
"""More, 1/m, would be as opaque; products of it stay finite."""


def has_volume(block: "bpy.types.ID") -> bool:
    """Whether anything is linked to the Volume of a material or a world."""
    output = output_node(block) if uses_nodes(block) else None
    return bool(output and source(output.inputs["Volume"]))


def medium_of(block: "bpy.types.ID") -> Medium | None:
    """The medium of a material or a world; None where it has none, or one that is not baked (`volume_shortcomings`)."""
    if not has_volume(block) or any(volume_shortcomings(block)):
        return None
    parts = [(_parts_of(closure), _anisotropy(closure)) for closure in read_closures(block, "Volume")]
    absorption, scattering = (np.sum([part[i] for part, _ in parts], axis=0) for i in range(2))
    weights = [float(scattered.mean()) for (_, scattered), _ in parts]
    if not absorption.any() and not scattering.any():
        return None
    g = float(np.average([g for _, g in parts], weights=weights)) if any(weights) else 0.0
    absorption, scattering = np.minimum((absorption, scattering), _DENSEST).astype(np.float32)
    return Medium(absorption, scattering, g)


def volume_shortcomings(block: "bpy.types.ID") -> Iterator[str]:
    """Half sentences about why a volume is not baked."""
    for closure in read_closures(block, "Volume") if has_volume(block) else ():
        if closure.kind not in _COEFFICIENTS:
            yield f"its volume is not baked, as its {closure.node.bl_label} is no medium that absorbs or scatters"
            return
        if any(constant(place) is None for place in _places(closure)):
            yield "its volume is not baked, as it differs from place to place"
            return
        if getattr(closure.node, "phase", _HENYEY_GREENSTEIN) not in (_HENYEY_GREENSTEIN, "RAYLEIGH"):
            yield "its volume is not baked, as its phase function is not Henyey and Greenstein's"
            return


def volume_differences(block: "bpy.types.ID") -> Iterator[str]:
    """Half sentences about what of a volume is not baked that is baked otherwise."""
    closures = read_closures(block, "Volume") if has_volume(block) else []
    if any(_emits(closure) for closure in closures):
        yield "the light that its volume emits is not baked"
    if any(getattr(closure.node, "phase", "") == "RAYLEIGH" for closure in closures):
        yield "its volume scatters evenly in all directions, and not by Rayleigh's phase function"


def _places(closure: Closure) -> Iterator[Place]:
    """The sockets that a volume shader's coefficients depend on."""
    names = {"Color", "Density", "Anisotropy", "Absorption Color", "Absorption Coefficients", "Scatter Coefficients"}
    yield from (closure.shader.input(one.identifier) for one in closure.node.inputs if one.identifier in names)
    yield from (factor.place for factor in closure.factors)


def _value(closure: Closure, identifier: str) -> np.ndarray:
    """A socket's constant value, (1 or 3,) float64."""
    value = constant(closure.shader.input(identifier))
    assert value is not None
    return np.asarray(value, np.float64)


def _parts_of(closure: Closure) -> Parts:
    """What a volume shader adds, by the shares of the Mix Shaders on the way to it."""
    known = {factor.place: constant(factor.place) for factor in closure.factors}

    def value(place: Place) -> np.ndarray:
        found = known[place]
        assert found is not None
        return found.reshape(1, 1, -1)

    share = float(closure.weight(value, set())[0, 0, 0])
    absorption, scattering = _COEFFICIENTS[closure.kind](closure)
    return np.maximum(share * absorption, 0), np.maximum(share * scattering, 0)


def _absorption(closure: Closure) -> Parts:
    density = max(float(_value(closure, "Density")[0]), 0)
    return density * (1 - _value(closure, "Color")), np.zeros(3)


def _scatter(closure: Closure) -> Parts:
    density = max(float(_value(closure, "Density")[0]), 0)
    return np.zeros(3), density * _value(closure, "Color")


def _principled(closure: Closure) -> Parts:
    density, color = max(float(_value(closure, "Density")[0]), 0), _value(closure, "Color")
    tint = np.sqrt(np.maximum(_value(closure, "Absorption Color"), 0))
    return density * np.maximum(1 - color, 0) * np.maximum(1 - tint, 0), density * color


def _by_coefficients(closure: Closure) -> Parts:
    return _value(closure, "Absorption Coefficients"), _value(closure, "Scatter Coefficients")


def _nothing(closure: Closure) -> Parts:
    return np.zeros(3), np.zeros(3)


_COEFFICIENTS: dict[str, Callable[[Closure], Parts]] = {
    "VOLUME_ABSORPTION": _absorption,
    "VOLUME_SCATTER": _scatter,
    "PRINCIPLED_VOLUME": _principled,
    "VOLUME_COEFFICIENTS": _by_coefficients,
    "EMISSION": _nothing,
}


def _anisotropy(closure: Closure) -> float:
    """Mean cosine of a volume shader's phase function."""
    if "Anisotropy" not in closure.node.inputs or getattr(closure.node, "phase", "") == "RAYLEIGH":
        return 0.0
    return float(np.clip(_value(closure, "Anisotropy")[0], -0.999, 0.999))


def _emits(closure: Closure) -> bool:
    """Whether a volume shader may emit light."""
    if closure.kind == "EMISSION":
        return True
    strengths = ("Emission Strength", "Blackbody Intensity", "Emission Coefficients")
    for name in strengths:
        if name in closure.node.inputs:
            value = constant(closure.shader.input(closure.node.inputs[name].identifier))
            if value is None or np.any(value > 0):
                return True
    return False
