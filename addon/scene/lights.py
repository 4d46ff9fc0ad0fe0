"""Lamps: the lights that have no mesh."""

from dataclasses import dataclass, fields, replace
from enum import IntEnum

import numpy as np

from .ray_kinds import RayKind

ALL_BOUNCES = 1024
"""Of a lamp whose light is never cut off."""


class LightKind(IntEnum):
    """What a lamp looks like."""

    POINT = 0
    SPOT = 1
    SUN = 2
    RECTANGLE = 3
    ELLIPSE = 4


AREA_LAMPS = (LightKind.RECTANGLE, LightKind.ELLIPSE)
"""Flat lamps with one shining side, whose `emission` is a radiance."""


class PatternDomain(IntEnum):
    """What a lamp's pattern is a function of."""

    DIRECTIONS = 0
    NORMALS = 1
    PLACES = 2


@dataclass(frozen=True, eq=False)
class LightPattern:
    """What a lamp's emission is multiplied by, as its nodes have it: an IES profile, a gobo, a picture.

    Attributes
    ----------
    values : (h, w, 3) float32
        Over directions or normals: rows of even height in the angle from the lamp's `direction` on, in which column u
        lies at the azimuth π − 2πu of axis_x to axis_y. Over places: rows along axis_y of columns along axis_x.
    domain : PatternDomain
        DIRECTIONS: in which the light leaves. NORMALS: of the sphere where it leaves (POINT and SPOT). PLACES: of the
        rectangle around the lamp (RECTANGLE and ELLIPSE).
    angle : float, rad
        From `direction` to the last row's end; there is no light beyond it.
    """

    values: np.ndarray
    domain: PatternDomain = PatternDomain.DIRECTIONS
    angle: float = np.pi


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
        RECTANGLE and ELLIPSE: radiance, W/(m² sr), from the front only; with a spread, that of a lamp without one of
        the same power. Below 0 of lamps that take light away.
    position : (l, 3) float32, m
    axis_x, axis_y, direction : (l, 3) float32
        Unit vectors of the lamp's frame; it shines along `direction` (Blender's local −Z).
    size : (l, 2) float32, m
        RECTANGLE: sides along axis_x and axis_y. ELLIPSE: diameters along them. Otherwise 0.
    radius : (l,) float32, m
        POINT and SPOT: radius of the emitting disc or sphere, 0 for a point. Otherwise 0.
    sphere : (l,) bool
        POINT and SPOT: a sphere emits; otherwise a disc does, that faces whoever looks at it.
    angle : (l,) float32, rad
        SPOT: full opening angle of the cone. SUN: full angle of the disc seen from the scene. Otherwise 0.
    blend : (l,) float32
        SPOT: softness of the cone's edge in [0, 1]. Otherwise 0.
    stretch : (l, 2) float32
        SPOT: how much wider the cone is along axis_x and axis_y than its angle says, as factors of the tangent.
        Otherwise 1.
    spread : (l,) float32, rad
        RECTANGLE and ELLIPSE: full angle beyond which nothing is emitted; π without a spread. Otherwise π.
    seen_by_diffuse, seen_in_gloss, seen_through_glass : (l,) bool
        Whether surfaces scatter the lamp's light by their diffuse, glossy, and transmissive lobes.
    met_by_rays : (l,) bool
        Whether rays meet the lamp, if it has a size.
    max_bounces : (l,) int32
        The lamp's light counts as far as so many surfaces away from receivers: 0 where it falls on them alone, 1 where
        they see what it falls on.
    distance_power : (l,) int32
        The light falls off with distance d as d^(distance_power − 2): 0, 1 or 2. SUN: 0.
    smoothing : (l,) float32, m²
        s of a factor d² / (s + d²) on the light, which keeps it from growing without bound near the lamp.
    patterns : tuple of LightPattern or None
        Of each lamp.
    illuminates : (l, o) bool or None
        Which objects of the scene each lamp lights; None where every lamp lights all.
    blocked_by : (l, o) bool or None
        Which objects keep each lamp's light away; None where all do that cast shadows.
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
    sphere: np.ndarray
    angle: np.ndarray
    blend: np.ndarray
    stretch: np.ndarray
    spread: np.ndarray
    seen_by_diffuse: np.ndarray
    seen_in_gloss: np.ndarray
    seen_through_glass: np.ndarray
    met_by_rays: np.ndarray
    max_bounces: np.ndarray
    distance_power: np.ndarray
    smoothing: np.ndarray
    patterns: tuple[LightPattern | None, ...]
    illuminates: np.ndarray | None = None
    blocked_by: np.ndarray | None = None

    def __len__(self) -> int:
        return len(self.kind)

    @staticmethod
    def join(lights: "list[Lights]") -> "Lights":
        """All lamps of several `Lights`, that are not linked to objects yet."""
        arrays = {name: np.concatenate([getattr(part, name) for part in lights]) for name in _COLUMNS}
        names, patterns = (tuple(one for part in lights for one in getattr(part, of)) for of in ("names", "patterns"))
        return Lights(names=names, patterns=patterns, **arrays)

    def where(self, k: np.ndarray) -> "Lights":
        """The lamps that `k`, indices or (l,) bool, chooses, linked as they are."""
        arrays = {name: getattr(self, name)[k] for name in _COLUMNS}
        illuminates, blocked_by = (None if of is None else of[k] for of in (self.illuminates, self.blocked_by))
        chosen = np.arange(len(self))[k]
        names, patterns = tuple(self.names[i] for i in chosen), tuple(self.patterns[i] for i in chosen)
        lights = Lights(names=names, patterns=patterns, **arrays)
        return replace(lights, illuminates=illuminates, blocked_by=blocked_by)

    def seen_by(self, kind: RayKind) -> np.ndarray:
        """Whose light surfaces scatter by the lobe that rays of a kind follow, (l,) bool."""
        of_kind = {RayKind.DIFFUSE: self.seen_by_diffuse, RayKind.GLOSSY: self.seen_in_gloss}
        of_kind |= {RayKind.TRANSMITTED: self.seen_through_glass}
        return of_kind.get(kind, np.ones(len(self), bool))

    @staticmethod
    def of(names: tuple[str, ...], kind: np.ndarray, **columns: np.ndarray) -> "Lights":
        """Lamps of some kinds without patterns; columns that are left out are as for kinds without them."""
        n = len(kind)
        vectors = {name: np.zeros((n, 3), np.float32) for name in ("emission", "position")}
        axes = {"axis_x": (1, 0, 0), "axis_y": (0, 1, 0), "direction": (0, 0, -1)}
        frame = {name: np.tile(np.array(axis, np.float32), (n, 1)) for name, axis in axes.items()}
        scalars = {name: np.zeros(n, np.float32) for name in ("radius", "angle", "blend")}
        rest = {
            "size": np.zeros((n, 2), np.float32),
            "sphere": np.zeros(n, bool),
            "stretch": np.ones((n, 2), np.float32),
            "spread": np.full(n, np.pi, np.float32),
            "seen_by_diffuse": np.ones(n, bool),
            "seen_in_gloss": np.ones(n, bool),
            "seen_through_glass": np.ones(n, bool),
            "met_by_rays": np.ones(n, bool),
            "max_bounces": np.full(n, ALL_BOUNCES, np.int32),
            "distance_power": np.zeros(n, np.int32),
            "smoothing": np.zeros(n, np.float32),
        }
        given = {name: np.asarray(column, rest.get(name, scalars["radius"]).dtype) for name, column in columns.items()}
        arrays = vectors | frame | scalars | rest | given
        return Lights(names, np.asarray(kind, np.int32), patterns=(None,) * n, **arrays)

    @staticmethod
    def none() -> "Lights":
        """No lamps."""
        return Lights.of((), np.zeros(0, np.int32))


_COLUMNS = [f.name for f in fields(Lights) if f.name not in ("names", "patterns", "illuminates", "blocked_by")]
