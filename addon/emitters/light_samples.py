"""Points of lamps, and the irradiance that each gives over the density that it is drawn with."""

from functools import partial

import numpy as np

from ..core.sampling.vectors import dot, rows
from ..core.sampling.warps import sample_uniform_cone, sample_uniform_disk, to_world
from ..scene import LightKind, Lights
from .lamp_sources import sample_area_lamp


def light_samples(
    lights: Lights, lamp: np.ndarray, positions: np.ndarray, normals: np.ndarray, u: np.ndarray, far: np.float32
) -> tuple[np.ndarray, np.ndarray]:
    """A point on a lamp for each of n positions, and what it gives there if nothing is between.

    Parameters
    ----------
    lamp : (n,) int
    positions, normals : (n, 3) float32
        World space, m; unit normals of the sides that are lit.
    u : (n, 2) float32
        Points of the unit square.
    far : float32, m
        How far away suns are.

    Returns
    -------
    targets, irradiance : (n, 3) float32, m and W/m²
        The irradiance is over the density of the point on its lamp: its mean is the lamp's.
    """
    targets, irradiance = np.zeros_like(positions), np.zeros_like(positions)
    for kinds, sample in (
        ((LightKind.POINT, LightKind.SPOT), _from_points),
        ((LightKind.RECTANGLE, LightKind.ELLIPSE), _from_areas),
        ((LightKind.SUN,), partial(_from_suns, far=far)),
    ):
        k = np.flatnonzero(np.isin(lights.kind[lamp], kinds))
        if len(k):
            targets[k], irradiance[k] = sample(lights, lamp[k], rows(positions, k), rows(normals, k), rows(u, k))
    return targets, irradiance


def directions_to(positions: np.ndarray, targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit directions from positions to targets, and the distances (at least 1e-6 m: nothing is infinitely close)."""
    way = targets - positions
    distance = np.maximum(np.sqrt(dot(way, way)), np.float32(1e-6))
    return way / distance[:, None], distance


def _from_points(
    lights: Lights, lamp: np.ndarray, positions: np.ndarray, normals: np.ndarray, u: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Point and spot lamps: points of the disc of radius r that faces the position, of radiance L = I/(πr²).

    E = L A cos θ cos θ' / d² = I cos θ cos θ' / d², which on the axis adds up to I/(d² + r²), as in Cycles. Of a
    sphere a position sees the cap within the half angle arcsin(r/d) instead: E = L cos θ Ω.
    """
    centres = rows(lights.position, lamp)
    axis, _ = directions_to(centres, positions)
    disc = np.concatenate([sample_uniform_disk(u), np.zeros((len(u), 1), np.float32)], axis=1)
    targets = centres + lights.radius[lamp, None] * to_world(disc, axis)
    directions, distance = directions_to(positions, targets)
    share = -dot(directions, axis) / distance**2
    spot = lights.kind[lamp] == LightKind.SPOT
    k = np.flatnonzero(lights.sphere[lamp] & (lights.radius[lamp] > 0))
    if len(k):
        targets[k], directions[k], share[k], outside = _on_spheres(lights, lamp[k], rows(positions, k), rows(u, k))
        spot[k] &= outside
    falloff = np.where(spot, lights.spot_falloff(lamp, lights.in_cone(lamp, -directions)), 1)
    share = share * falloff * np.maximum(dot(directions, normals), 0)
    return targets, rows(lights.emission, lamp) * share[:, None]


def _on_spheres(
    lights: Lights, lamp: np.ndarray, positions: np.ndarray, u: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, 3) of spheres uniform by the solid angle Ω seen, directions to them (n, 3), and Ω/(πr²) (n,).

    From inside all directions are seen, and no cone, as in Cycles; last is who is outside, (n,) bool.
    """
    axis, distance = directions_to(positions, rows(lights.position, lamp))
    d, r = distance.astype(np.float64), lights.radius[lamp].astype(np.float64)
    outside = d > r
    cos_max = np.where(outside, np.sqrt(np.maximum(1 - (r / d) ** 2, 0)), -1)
    local = sample_uniform_cone(u, cos_max)
    chord = np.sqrt(np.maximum(r**2 - d**2 * (1 - local[:, 2].astype(np.float64) ** 2), 0))
    distance = (d * local[:, 2] - np.where(outside, chord, -chord)).astype(np.float32)
    directions = to_world(local, axis)
    share = (2 * (1 - cos_max) / r**2).astype(np.float32)
    return positions + distance[:, None] * directions, directions, share, outside


def _from_areas(
    lights: Lights, lamp: np.ndarray, positions: np.ndarray, normals: np.ndarray, u: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Area lamps: points uniform by area; E = L A cos θ cos θ' / d², from the front only and within the spread."""
    targets, area, axis = sample_area_lamp(lights, lamp, u), lights.area(lamp), rows(lights.direction, lamp)
    height = np.maximum(dot(positions - rows(lights.position, lamp), axis), 0)
    radius = lights.spread_radius(lamp, height)
    k = np.flatnonzero(np.float32(np.pi) * radius**2 < area)
    if len(k):
        # Little of the lamp shines at these positions: points of that part
        foot = rows(positions, k) - height[k, None] * rows(axis, k)
        place = sample_uniform_disk(rows(u, k)) * radius[k, None]
        targets[k] = foot + place[:, :1] * lights.axis_x[lamp[k]] + place[:, 1:] * lights.axis_y[lamp[k]]
        area[k] = np.pi * radius[k] ** 2 * lights.contain(lamp[k], targets[k])
    directions, distance = directions_to(positions, targets)
    cos_lamp = np.maximum(-dot(directions, axis), 0)
    cosines = np.maximum(dot(directions, normals), 0) * cos_lamp
    aside = directions + cos_lamp[:, None] * axis
    tan_lamp = np.sqrt(dot(aside, aside)) / np.maximum(cos_lamp, np.float32(1e-6))
    share = area * cosines / distance**2 * lights.spread_falloff(lamp, tan_lamp)
    return targets, rows(lights.emission, lamp) * share[:, None]


def _from_suns(
    lights: Lights, lamp: np.ndarray, positions: np.ndarray, normals: np.ndarray, u: np.ndarray, far: np.float32
) -> tuple[np.ndarray, np.ndarray]:
    """Suns: directions uniform over the disc; E = E₀ cos θ · 2/(1 + cos(α/2)), see `SunSource`."""
    cos_max = lights.cos_half_cone(lamp)
    directions = -to_world(sample_uniform_cone(u, cos_max), rows(lights.direction, lamp))
    cosine = np.maximum(dot(directions, normals), 0)
    return positions + far * directions, rows(lights.emission, lamp) * (cosine * 2 / (1 + cos_max))[:, None]
