"""Lamps: the lights that have no mesh."""

from dataclasses import dataclass, fields
from enum import IntEnum

import numpy as np


class LightKind(IntEnum):
    """What a lamp looks like."""

    POINT = 0
    SPOT = 1
    SUN = 2
    RECTANGLE = 3
    ELLIPSE = 4


@dataclass(frozen=True)
class Lights:
    """The l lamps of a scene, in world space. Lamps themselves block no light.

    Attributes
    ----------
    names : tuple of str
        Names for messages.
    kind : (l,) int32
        `LightKind`.
    emission : (l, 3) float32
        POINT and SPOT: radiant intensity, W/sr (a spot's inside its cone, before the blend).
        SUN: irradiance on a surface that faces it, W/m².
        RECTANGLE and ELLIPSE: radiance, W/(m² sr), from the front only.
    position : (l, 3) float32, m
    axis_x, axis_y, direction : (l, 3) float32
        Unit vectors of the lamp's frame; it shines along `direction` (Blender's local −Z).
    size : (l, 2) float32, m
        RECTANGLE: sides along axis_x and axis_y. ELLIPSE: diameters along them. Otherwise 0.
    radius : (l,) float32, m
        POINT and SPOT: radius of the emitting disc that faces whoever looks at it, 0 for a point. Otherwise 0.
    angle : (l,) float32, rad
        SPOT: full opening angle of the cone. SUN: full angle of the disc seen from the scene. Otherwise 0.
    blend : (l,) float32
        SPOT: softness of the cone's edge in [0, 1]. Otherwise 0.
    """

    names: tuple[str, ...]
    kind: np.ndarray
    emission: np.ndarray
    position: np.ndarray
    axis_x: np.ndarray
    axis_y: np.ndarray
    direction: np.ndarray
    size: np.ndarray
    radius: np.ndarray
    angle: np.ndarray
    blend: np.ndarray

    def __len__(self) -> int:
        return len(self.kind)

    @staticmethod
    def join(lights: "list[Lights]") -> "Lights":
        """All lamps of several `Lights`."""
        arrays = {
            f.name: np.concatenate([getattr(part, f.name) for part in lights])
            for f in fields(Lights)
            if f.name != "names"
        }
        return Lights(names=tuple(name for part in lights for name in part.names), **arrays)

    @staticmethod
    def none() -> "Lights":
        """No lamps."""
        vectors = {n: np.zeros((0, 3), np.float32) for n in ("emission", "position", "axis_x", "axis_y", "direction")}
        scalars = {n: np.zeros(0, np.float32) for n in ("radius", "angle", "blend")}
        return Lights(names=(), kind=np.zeros(0, np.int32), size=np.zeros((0, 2), np.float32), **vectors, **scalars)

    def cos_half_cone(self, lamp: np.ndarray | int) -> np.ndarray:
        """Cosine of half the opening angle of lamps, (n,) float32."""
        return np.cos(self.angle[lamp] / 2)

    def spot_falloff(self, lamp: np.ndarray | int, cos_theta: np.ndarray) -> np.ndarray:
        """Share of a spot's intensity at an angle from its axis: a smoothstep over the blend, (n,) float32.

        With c the cosine of the half angle and b the blend, s((cos θ − c) / (b(1 − c))), s(t) = t²(3 − 2t), as Cycles.
        """
        c = self.cos_half_cone(lamp)
        width = np.maximum(self.blend[lamp] * (1 - c), np.float32(1e-5))
        t = np.clip((cos_theta - c) / width, 0, 1)
        return t * t * (3 - 2 * t)

    def area(self, lamp: np.ndarray) -> np.ndarray:
        """Area of area lamps, (n,) float32, m²."""
        box = self.size[lamp].prod(axis=-1)
        return np.where(self.kind[lamp] == LightKind.ELLIPSE, np.float32(np.pi / 4) * box, box)
