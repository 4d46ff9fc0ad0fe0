"""Lamps whose nodes make their light differ: by direction or place, as Cycles renders it, and by distance."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import atan, pi, tan

import bpy
import numpy as np

from ....scene import AREA_LAMPS, LightKind, LightPattern, Lights, PatternDomain
from ...temporary import CyclesError
from ...warn import Warnings
from .cycles_lamp import LampShape, pattern_of_lamp
from .light_shader import differs_by, falloff_of

_ALIKE = 2e-3
"""Relative root mean square of a pattern's differences below which its values are one: Cycles' noise."""


@dataclass(frozen=True)
class LampNodes:
    """A lamp whose nodes only Cycles can tell.

    Attributes
    ----------
    light : bpy.types.Light
        Original, not evaluated.
    shape : LampShape
    name : str
        For messages.
    """

    light: "bpy.types.Light"
    shape: LampShape
    name: str

    @staticmethod
    def of(light: "bpy.types.Light", lights: Lights, matrix: np.ndarray, name: str, warnings: Warnings) -> "LampNodes":
        """Those of an evaluated lamp that was read as the one of `lights`."""
        kind, angle, domain = LightKind(lights.kind[0]), pi, PatternDomain.DIRECTIONS
        if kind == LightKind.SPOT:
            half = float(lights.angle[0]) / 2
            angle = atan(tan(half) * float(lights.stretch.max())) if half < pi / 2 - 1e-3 else pi / 2
        flat, sphere = kind in AREA_LAMPS, kind != LightKind.SUN and lights.sphere[0]
        if flat:
            angle = pi / 2
        if flat or sphere:
            asked = differs_by(light, sphere)
            if asked != {"direction"}:
                domain = PatternDomain.PLACES if flat else PatternDomain.NORMALS
            if asked >= {"direction", "place"}:
                warnings.add(
                    f"Light '{name}': its nodes give a light that differs both by place and by direction, of which "
                    "what leaves it straight ahead is baked for all directions: make it differ by one of them."
                )
        width, height = lights.size[0].tolist()
        return LampNodes(light.original, LampShape(kind, domain, angle, (width, height), matrix), name)


def falling_off(lights: Lights, light: "bpy.types.Light", name: str, warnings: Warnings) -> Lights:
    """One lamp with the fall-off that its nodes say; a sun is as far from all, and has none."""
    falloff, n = falloff_of(light), len(lights)
    if not falloff.known:
        warnings.add(
            f"Light '{name}': how its nodes make it fall off with distance cannot be baked, so it falls off by the "
            "square: use one output of one Light Falloff node, with a constant Smooth, as a factor of its strength."
        )
    if lights.kind[0] == LightKind.SUN:
        return lights
    power, smoothing = np.full(n, falloff.distance_power, np.int32), np.full(n, falloff.smoothing, np.float32)
    return replace(lights, distance_power=power, smoothing=smoothing)


def with_patterns(
    lights: Lights, nodes: Sequence[LampNodes | None], scene: "bpy.types.Scene", warnings: Warnings
) -> Lights:
    """Lamps with what their nodes make of their light; not while Cycles bakes. `scene` is whose frame it is."""
    emission, patterns = lights.emission.copy(), list(lights.patterns)
    for k, of in enumerate(nodes):
        if of is None:
            continue
        try:
            pattern = pattern_of_lamp(of.light, of.shape, scene)
        except CyclesError as error:
            warnings.add(
                f"Light '{of.name}': Cycles could not render what its nodes make of its light ({error}), so its own "
                "color and power are baked: enable Cycles, or give its Emission node one color and strength."
            )
            continue
        same = _one_value(pattern)
        if same is None:
            patterns[k] = pattern
        else:
            emission[k] *= same
    return replace(lights, emission=emission, patterns=tuple(patterns))


def _one_value(pattern: LightPattern) -> np.ndarray | None:
    """The value of a pattern that is the same everywhere, (3,)."""
    mean: np.ndarray = pattern.values.mean(axis=(0, 1), dtype=np.float64)
    differs = np.sqrt(((pattern.values - mean) ** 2).mean()) > _ALIKE * np.abs(mean).max()
    return None if differs else mean
