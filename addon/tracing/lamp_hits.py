"""Lamps as rays meet them: those that have a size are seen in mirrors and through glass, and block no light.

As Cycles 4.5 and 5.2 show them: discs that face who looks, spheres, the front of area lamps, suns behind everything.
"""

from dataclasses import dataclass

import numpy as np

from ..core.sampling.vectors import dot
from ..scene import LightKind, Lights, RayKind

_BEHIND_ALL = np.finfo(np.float32).max
"""Distance of suns, m: nearer than nothing."""

_LEAST_COSINE = np.float32(1e-6)
_TINY = np.float32(1e-12)
"""For divisions: of a lamp's area, m², say; a thousandth of a millimetre across is no size."""


@dataclass(frozen=True)
class LampHits:
    """Where n rays meet one lamp each.

    Attributes
    ----------
    distance : (n,) float32, m
        Infinite where a ray misses its lamp.
    radiance : (n, 3) float32, W/(m² sr)
    density : (n,) float32, 1/sr
        With which a point of the lamp lies in the ray's direction, if points are drawn evenly from what is seen of it;
        infinite where it is missed.
    """

    distance: np.ndarray
    radiance: np.ndarray
    density: np.ndarray


def lamp_hits(lights: Lights, lamp: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> LampHits:
    """Where rays with origins and unit directions (n, 3) meet lamps (n,); no ray meets a lamp without a size."""
    n = len(origins)
    hits = LampHits(np.full(n, np.inf, np.float32), np.zeros((n, 3), np.float32), np.full(n, np.inf, np.float32))
    sized = has_size(lights)[lamp]
    for kinds, meet in (
        ((LightKind.POINT, LightKind.SPOT), _meet_balls),
        ((LightKind.RECTANGLE, LightKind.ELLIPSE), _meet_areas),
        ((LightKind.SUN,), _meet_suns),
    ):
        k = np.flatnonzero(np.isin(lights.kind[lamp], kinds) & sized)
        if len(k) == 0:
            continue
        met, distance, radiance_share, density = meet(lights, lamp[k], origins[k], directions[k])
        k, chosen = k[met], np.flatnonzero(met)
        hits.distance[k], hits.density[k] = distance[chosen], density[chosen]
        hits.radiance[k] = lights.emission[lamp[k]] * radiance_share[chosen, None]
    return hits


def lamps_along(
    lights: Lights,
    origins: np.ndarray,
    directions: np.ndarray,
    distance: np.ndarray,
    kind: np.ndarray,
    objects: np.ndarray,
    least_density: np.ndarray | None = None,
) -> np.ndarray:
    """Radiance of all lamps that rays meet, (n, 3) float32, W/(m² sr).

    Parameters
    ----------
    origins, directions : (n, 3) float32
    distance : (n,) float32, m
        To where surfaces end the rays.
    kind : (n,) of RayKind
        Lamps may be hidden from glossy and transmitted rays.
    objects : (n,) int
        That the rays start from, for lamps that do not light all.
    least_density : (n,) float32, 1/sr, optional
        Lamps whose `LampHits.density` is not below this are left out.
    """
    radiance = np.zeros_like(origins)
    for lamp in np.flatnonzero(has_size(lights)):
        seen = np.where(kind == RayKind.TRANSMITTED, lights.seen_through_glass[lamp], lights.seen_in_gloss[lamp])
        if lights.illuminates is not None:
            seen &= lights.illuminates[lamp, objects]
        k = np.flatnonzero(seen)
        hits = lamp_hits(lights, np.full(len(k), lamp), origins[k], directions[k])
        met = hits.distance < distance[k]
        if least_density is not None:
            met &= hits.density < least_density[k]
        radiance[k[met]] += hits.radiance[met]
    return radiance


def has_size(lights: Lights) -> np.ndarray:
    """Which lamps rays can meet, (l,) bool."""
    return (lights.radius > 0) | (lights.size > 0).all(axis=1) | ((lights.kind == LightKind.SUN) & (lights.angle > 0))


_Met = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""Which rays meet their lamps, at which distance, the radiance as a share of the lamps' emission, and the density."""


def _meet_balls(lights: Lights, lamp: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> _Met:
    """Point and spot lamps: spheres, and discs that face the origins, of radiance I/(πr²).

    From inside a sphere its far side is met, with no cone.
    """
    centre, r = lights.position[lamp] - origins, lights.radius[lamp]
    along = dot(centre, directions)
    away = np.sqrt(dot(centre, centre))
    off_axis = centre - along[:, None] * directions
    half_chord = np.sqrt(np.maximum(r * r - dot(off_axis, off_axis), 0))
    ball, inside = lights.sphere[lamp], lights.sphere[lamp] & (away < r)
    cosine = np.maximum(along / np.maximum(away, _TINY), _LEAST_COSINE)
    distance = np.where(ball, along + np.where(inside, half_chord, -half_chord), away / cosine)
    off_disc = centre - distance[:, None] * directions
    aside = np.where(ball, dot(off_axis, off_axis), dot(off_disc, off_disc))
    met = (aside < r * r) & ((along > 0) | inside)

    cone = (lights.kind[lamp] == LightKind.SPOT) & ~inside
    falloff = np.where(cone, lights.spot_falloff(lamp, lights.in_cone(lamp, -directions)), 1)
    area = np.float32(np.pi) * np.maximum(r * r, _TINY)
    sin2 = np.minimum(r / np.maximum(away, _TINY), 1) ** 2
    versine = np.where(inside, 2, sin2 / (1 + np.sqrt(1 - sin2)))  # 1 − cos of half the cap's angle
    of_ball = 1 / np.maximum(2 * np.float32(np.pi) * versine, _TINY)
    return met, distance, falloff / area, np.where(ball, of_ball, distance**2 / (area * cosine))


def _meet_areas(lights: Lights, lamp: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> _Met:
    """Area lamps, from the front only and within their spread."""
    axis = lights.direction[lamp]
    cosine = -dot(directions, axis)
    height = dot(origins - lights.position[lamp], axis)
    facing = (cosine > _LEAST_COSINE) & (height > 0)
    cosine = np.maximum(cosine, _LEAST_COSINE)
    distance = np.where(facing, height, 0) / cosine
    met = facing & lights.contain(lamp, origins + distance[:, None] * directions)
    aside = directions + cosine[:, None] * axis
    falloff = lights.spread_falloff(lamp, np.sqrt(dot(aside, aside)) / cosine)
    return met, distance, falloff, distance**2 / np.maximum(lights.area(lamp) * cosine, _TINY)


def _meet_suns(lights: Lights, lamp: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> _Met:
    """Suns: discs of radiance E/(π sin²(α/2)) behind everything."""
    half = lights.angle[lamp] / 2
    sin2, axis = np.maximum(np.sin(half) ** 2, _TINY), lights.direction[lamp]
    cosine = -dot(directions, axis)
    aside = directions + cosine[:, None] * axis
    met = (dot(aside, aside) < sin2) & (cosine > 0)
    share = 1 / (np.float32(np.pi) * sin2)
    versine = np.maximum(2 * np.sin(half / 2) ** 2, _TINY)
    return met, np.full(len(lamp), _BEHIND_ALL), share, 1 / (2 * np.float32(np.pi) * versine)
