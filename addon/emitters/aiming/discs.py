"""Parallel light from outside, as the sun and the world send it: rays through discs that face where they come from.

The discs lie around the region of the receivers, each twice as wide as the one before, and the last around the whole
scene. Each gets the same share of the rays: many go where receivers are, and none carries much more than those beside.
With K discs of areas A_k a ray at x has the density p(x) = Σ_k [x in disc k] / (K A_k).
"""

from typing import NamedTuple

import numpy as np

from ...core.compiling import by_reference, part
from ...core.sampling.warps import uniform_disk
from ...core.vec3 import ONE, TWO, along, dot, frame, minus, plus, times
from ...scene import Scene
from .projection_map import cones_to_ball, halved, moved
from .regions import Sphere, bounding_sphere

_CLOSE = np.float32(1 - 1e-6)


@by_reference
class Discs(NamedTuple):
    """The nested discs, and the balls that they lie around: centres as triples and radii, float32, m.

    Attributes
    ----------
    radii : (k,) float32, m
        Of the discs around the region.
    density : (k + 1,) float32, 1/m²
        Σ 1/(K A_k) over those discs that are wider than a distance, by their number.
    density_of_whole : float32, 1/m²
        1/(K A) of the disc around the whole scene.
    area_of_region : float, m²
    """

    region: tuple
    region_radius: np.float32
    whole: tuple
    whole_radius: np.float32
    radii: np.ndarray
    density: np.ndarray
    density_of_whole: np.float32
    area_of_region: float


def discs_around(scene: Scene, region: Sphere) -> Discs:
    """The discs around a region and the whole scene."""
    whole = bounding_sphere(scene)
    smallest = max(region.radius, 1e-6 * whole.radius)  # a lone receiver's region may have no size
    n_inner = max(0, int(np.ceil(np.log2(whole.radius / smallest))))
    radii = (smallest * 2.0 ** np.arange(n_inner)).astype(np.float32)
    shares = 1 / ((n_inner + 1) * np.pi * radii.astype(np.float64) ** 2)
    return Discs(
        tuple(np.float32(x) for x in region.centre),
        np.float32(region.radius),
        tuple(np.float32(x) for x in whole.centre),
        np.float32(whole.radius),
        radii,
        np.append(np.cumsum(shares[::-1])[::-1], 0).astype(np.float32),
        np.float32(1 / ((n_inner + 1) * np.pi * whole.radius**2)),
        float(np.pi * smallest**2),
    )


def cone_to_whole(discs: Discs, position: np.ndarray, reach: float) -> tuple[float, np.ndarray]:
    """The cone around the whole scene from within `reach` of a position: the versine of half its angle, its axis."""
    versine, axis = cones_to_ball(discs.whole, float(discs.whole_radius), position[None], reach)
    return float(versine[0]), axis[0]


@part
def through_discs(emitters, source, direction, u):
    """Where a ray in a direction starts, outside the scene, and 1 over its density, m²."""
    discs, (aimed, choice) = emitters.discs, halved(emitters.balls, source, u[4])
    n_inner = len(discs.radii)
    chosen = min(int(choice * np.float32(n_inner + 1)), n_inner)
    of_region = chosen < n_inner
    radius = discs.radii[chosen] if of_region else discs.whole_radius
    centre = discs.region if of_region else discs.whole
    tangent, bitangent = frame(direction)
    x, y = uniform_disk(u[2], u[3])
    offset = plus(times(tangent, x * radius), times(bitangent, y * radius))

    # Squared distances of the line from the centre of its own disc, and from the other centre, at Δ from the first
    own, delta = u[2] * radius * radius, minus(discs.region, discs.whole)
    before = dot(direction, delta)
    other = own + (TWO if of_region else -TWO) * dot(offset, delta) + (dot(delta, delta) - before * before)
    from_region = own * _CLOSE if of_region else other
    n_narrower = 0
    while n_narrower < n_inner and discs.radii[n_narrower] * discs.radii[n_narrower] < from_region:
        n_narrower += 1
    density = discs.density[n_narrower]
    if not of_region or other <= discs.whole_radius * discs.whole_radius:
        density += discs.density_of_whole

    place = plus(centre, offset)
    place, area = moved(emitters.balls, source, aimed, u[2], u[3], place, direction, ONE / density)
    back = dot(minus(place, discs.whole), direction) + discs.whole_radius
    return along(place, -back, direction), area
