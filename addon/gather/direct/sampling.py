"""One light of many at a point: candidates of all emitters, resampled, and what is left to rays.

For each point M candidates are drawn from sources: lamps by what they would give around there, meshes and the world by
power. One of them is kept in proportion to the irradiance that it would give unshadowed, and one shadow ray decides
(resampled importance sampling: Talbot et al. 2005). With candidates y drawn with density p, and w(y) = f(y)/p(y), the
kept one gives f(y)/p(y) · (Σw/M) / w(y), whose mean is ∫f.

Close to an emissive mesh f/p has no bound, and where the world is dark f/p is large. There a cosine-weighted ray finds
them instead: each direction is sampled by the way that finds it more often, by the densities cos θ/π and p (the maximum
heuristic: Veach 1997, 9.2.4). What is left to such rays is called their own.
"""

from typing import NamedTuple

import numpy as np

from ...core.compiling import by_reference, part
from ...core.sampling.path_numbers import two_numbers
from ...core.vec3 import BLACK, ONE, ZERO, along, dot, mean, row, times
from ...emitters.lamps import LampArrays, cosine_at, lights_object, sample_lamp
from ...emitters.mesh import MeshArrays, lights_up, mesh_density, sample_mesh
from ...emitters.world import WorldArrays, sample_world, world_towards
from ...scene import RayKind
from ...scene.hit import emitted, is_back
from .lamp_choice import LampGrid, cell_of, choose_lamp

MAX_CANDIDATES = 4
N_PAIRS = 1 + 2 * MAX_CANDIDATES
"""Pairs of a path's numbers that `sample_emitters` uses up."""

DIFFUSE_RAY, GLOSSY_RAY = int(RayKind.DIFFUSE), int(RayKind.GLOSSY)
IN_AIR = ZERO, ZERO, ZERO
"""The normal of points that are on no surface: light counts alike from everywhere, and rays go anywhere."""

_PER_PI, _PER_SPHERE = np.float32(1 / np.pi), np.float32(1 / (4 * np.pi))
_TINY, _BELOW_ONE = np.float32(1e-30), np.float32(1 - 2**-24)


@by_reference
class DirectArrays(NamedTuple):
    """All that direct light comes from.

    Attributes
    ----------
    lamp_chance, mesh_chance, world_chance : float32
        With which a candidate is a lamp's, an emissive mesh's or the world's.
    n_candidates : int
    far : float32, m
        How far away suns and the world are.
    has_blockers : (l + 2 + g,) bool
        Lamps, the g `EmitterLinks` after them and two more, whose light some objects do not keep away that cast
        shadows; (0,) where all have the same blockers.
    blockers : (l + 2 + g, o) bool
        What keeps the light of those away.
    """

    lamps: LampArrays
    mesh: MeshArrays
    world: WorldArrays
    grid: LampGrid
    lamp_chance: np.float32
    mesh_chance: np.float32
    world_chance: np.float32
    n_candidates: int
    far: np.float32
    has_blockers: np.ndarray
    blockers: np.ndarray


@part
def sample_emitters(direct, scene, position, normal, object_, ray_kind, rays_own, key, path, i):
    """A point of an emitter, and the irradiance that it stands for if nothing is between.

    Parameters
    ----------
    position, normal : triples
        A point off its surface, m, and the unit normal of the side that is lit, or `IN_AIR`.
    object_ : int
        That the point is on, for lamps that do not light all; −1: they light all.
    ray_kind : int
        `RayKind` of the rays that follow the lobe that is lit, from which emitters may be hidden.
    rays_own : bool
        Leave out what a cosine-weighted ray finds more often; `met_radiance` says what that is.
    i : int
        The first of `N_PAIRS` pairs of the path's numbers.

    Returns
    -------
    target, irradiance : triples, m and W/m²
    lamp : int
        From the number of lamps on: emissive meshes, the world, and groups of emissive objects with own blockers.
    lit : bool
    """
    start, choice = two_numbers(key, path, i)
    total = kept = ZERO
    target, light, lamp = position, BLACK, np.int64(len(direct.lamps.kind))
    point = cell_of(direct.grid, position), position, normal, object_, ray_kind, rays_own
    for j in range(direct.n_candidates):
        place = min((np.float32(j) + start) / np.float32(direct.n_candidates), _BELOW_ONE)
        at, given, of = _candidate(direct, scene, *point, place, key, path, i + 1 + 2 * j)
        weight = mean((abs(given[0]), abs(given[1]), abs(given[2])))  # lamps may take light away
        if weight > ZERO:
            total += weight
            share = weight / total
            if choice < share:
                target, light, lamp, kept, choice = at, given, of, weight, choice / share
            else:
                choice = (choice - share) / (ONE - share)
            choice = min(choice, _BELOW_ONE)  # at 1 a candidate that is all of the total would not be kept
    if total <= ZERO:
        return target, BLACK, lamp, False
    return target, times(light, total / (np.float32(direct.n_candidates) * kept)), lamp, True


@part
def _candidate(direct, scene, cell, position, normal, object_, ray_kind, rays_own, place, key, path, i):
    """A point of an emitter that a number chooses, the irradiance from it over its density, and which emitter it is."""
    u, v = two_numbers(key, path, i)
    by_lamps, n_lamps = direct.lamp_chance, np.int64(len(direct.lamps.kind))
    if place < by_lamps or (direct.mesh_chance == ZERO and direct.world_chance == ZERO):
        lamp, chance = choose_lamp(direct.grid, cell, min(place / by_lamps, _BELOW_ONE))
        if not (direct.lamps.seen[ray_kind, lamp] and lights_object(direct.lamps, lamp, object_)):
            return position, BLACK, lamp
        target, light = sample_lamp(direct.lamps, lamp, position, normal, u, v, direct.far)
        return target, times(light, ONE / max(chance * by_lamps, _TINY)), lamp
    if place < by_lamps + direct.mesh_chance or direct.world_chance == ZERO:
        of, chance = n_lamps, direct.mesh_chance
        w, _ = two_numbers(key, path, i + 1)
        target, way, light, density, emitter = sample_mesh(scene, direct.mesh, position, w, u, v)
        if not lights_up(scene, emitter, object_):
            return target, BLACK, of
        if has_own_blockers(direct, scene, emitter):
            of, rays_own = n_lamps + 2 + scene.link_group[emitter], False
    else:
        way, radiance, density = sample_world(direct.world, u, v)
        of, chance, target = n_lamps + 1, direct.world_chance, along(position, direct.far, way)
        light = times(radiance, ONE / max(density, _TINY)) if direct.world.seen[ray_kind] else BLACK
    cosine = cosine_at(normal, way)
    if cosine <= ZERO or (rays_own and _ray_density(normal, way) > chance * density):
        return target, BLACK, of
    return target, times(light, cosine / chance), of


@part
def met_radiance(direct, scene, triangle, distance, u, v, direction, normal, object_):
    """Radiance that a cosine-weighted ray meets and that is its own: of emissive triangles, and of the world.

    A constant world is all the rays'. What see-through surfaces on the way leave of it is for the caller to apply.

    Parameters
    ----------
    triangle, distance, u, v
        Where the ray ends; −1 where it meets no triangle.
    direction, normal : triples
        Of the ray, and of the surface that it starts from, or `IN_AIR`.
    object_ : int
        Of that surface, for emissive objects that do not light all.
    """
    by_rays = _ray_density(normal, direction)
    if triangle < 0:
        radiance, density = world_towards(direct.world, direction)
        sampled = direct.world.height > 0 and by_rays <= direct.world_chance * density
        return BLACK if sampled or not direct.world.seen[DIFFUSE_RAY] else radiance
    if direct.mesh_chance == ZERO or direct.mesh.density[triangle] <= ZERO:
        return BLACK
    emitter = scene.object[triangle]
    if not lights_up(scene, emitter, object_) or has_own_blockers(direct, scene, emitter):
        return BLACK
    facing = abs(dot(direction, row(scene.normals, triangle)))
    if by_rays <= direct.mesh_chance * mesh_density(direct.mesh, triangle, distance, facing):
        return BLACK
    # Rays stop in proportion to the coverage, so that it must not weigh what they meet
    return emitted(scene, triangle, u, v, is_back(scene, triangle, direction), DIFFUSE_RAY)


@part
def _ray_density(normal, direction):
    """With which rays are sent from a surface, by the cosine, or from the air, 1/sr."""
    return _PER_SPHERE if normal == IN_AIR else dot(direction, normal) * _PER_PI


@part
def has_own_blockers(direct, scene, emitter):
    """Whether some objects that cast shadows do not keep an emissive object's light away; rays would end on them."""
    if len(scene.link_group) == 0:
        return False
    group = scene.link_group[emitter]
    return group >= 0 and direct.has_blockers[len(direct.lamps.kind) + 2 + group]


@part
def unsampled_sky(direct, ray_kind):
    """Radiance of a constant world that rays of a kind see; none of one that is a picture, whose light is sampled."""
    return direct.world.color if direct.world.height == 0 and direct.world.seen[ray_kind] else BLACK
