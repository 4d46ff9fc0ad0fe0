"""Places and sides of surfaces that light meets, found by a few rays before there are maps."""

from dataclasses import dataclass

import numpy as np

from ....core.sampling.warps import sample_cosine_hemisphere, to_world
from ....scene import Scene
from ....scene.surface_points import surface_points
from ...protocol import Tracer
from ..box import through_box, widened

_N_BOUNCES = 3
_SPACING = 1 / 50  # of points on surfaces, of the region's diagonal
_N_RAYS = 1000


@dataclass(frozen=True)
class LightRays:
    """Rays that leave lamps, as many from each as it has power: origins and unit directions, (n, 3) float32, m."""

    origins: np.ndarray
    directions: np.ndarray


@dataclass(frozen=True)
class LitSides:
    """Where rays start and end: positions just off the surface and unit normals of the side, (n, 3) float32, m.

    Where rays start in free space, the normal is their direction.
    """

    positions: np.ndarray
    normals: np.ndarray


def lit_sides(scene: Scene, tracer: Tracer, light: LightRays, random: np.random.Generator) -> LitSides:
    """Follow at most a thousand of the rays over some surfaces, all of which scatter diffusely here."""
    chosen = random.choice(len(light.origins), min(_N_RAYS, len(light.origins)), replace=False)
    origins, directions = light.origins[chosen], light.directions[chosen]
    enter, leave = through_box(widened(scene.bounds, 1e-4), origins, directions)
    through = enter < leave
    origins, directions = (origins + enter[:, None] * directions)[through], directions[through]
    sides = [LitSides(origins, directions)]
    for _ in range(_N_BOUNCES):
        hits = tracer.closest_hit(origins, directions)
        directions, hits = directions[hits.hit], hits.where(hits.hit)
        positions, normals = hits.points(scene, directions)
        origins = positions + scene.ray_offset(hits.triangle, positions) * normals
        directions = to_world(sample_cosine_hemisphere(random.random((len(origins), 2), np.float32)), normals)
        sides.append(LitSides(origins, normals))
    return LitSides(*(np.concatenate([getattr(side, name) for side in sides]) for name in ("positions", "normals")))


def surface_rays(scene: Scene, region: np.ndarray, random: np.random.Generator) -> LightRays:
    """Rays from both sides of the surfaces in a region, evenly by area."""
    parts = list(surface_points(scene, region, float(np.linalg.norm(region[1] - region[0])) * _SPACING))
    if not parts:
        return LightRays(*np.zeros((2, 0, 3), np.float32))
    positions = np.concatenate([part.position for part in parts]).astype(np.float32)
    triangle = np.tile(np.concatenate([part.triangle for part in parts]), 2)
    normals = scene.normals[triangle]
    normals[len(positions) :] *= -1
    positions = np.tile(positions, (2, 1))
    directions = to_world(sample_cosine_hemisphere(random.random((len(positions), 2), np.float32)), normals)
    return LightRays(positions + scene.ray_offset(triangle, positions) * normals, directions)
