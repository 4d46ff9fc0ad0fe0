"""Emissive meshes: all emissive triangles together; each side emits a radiance L, the same in every direction.

Emission may be negative. Objects that diffuse rays do not see do not shine on diffuse surfaces.
"""

from typing import NamedTuple

import numpy as np

from ..core.compiling import by_reference, kernel, kernel_array, part, routine
from ..core.sampling.cutpoint_table import CutpointTable, cutpoint_table, drawn_cell
from ..core.sampling.sobol import fixed_points
from ..core.sampling.warps import PI, cosine_hemisphere, sample_uniform_triangle, uniform_triangle
from ..core.vec3 import BLACK, ONE, TWO, ZERO, along, direction_to, dot, negative, put, row, times, to_world
from ..scene import RayKind, Scene
from ..scene.arrays import SceneArrays
from ..scene.hit import emitted, is_back, look_up, point_at, ray_offset
from .aiming.discs import Discs
from .aiming.projection_map import halved, redirected
from .aiming.target_region import aimed_direction, per_density_towards, towards_region
from .row import MESH, SourceRow

_BY_OBJECT = 0.1
_DIFFUSE_RAY = int(RayKind.DIFFUSE)
_LEAST_COSINE = np.float32(1e-6)
_N_POINTS = 1 << 20
"""Points at which textured emission is looked at, at a time."""


@by_reference
class MeshArrays(NamedTuple):
    """The e emissive triangles of a scene.

    Attributes
    ----------
    triangles : (e,) int32
    table : CutpointTable
        Of their chances to be chosen: half by power and half by what could arrive in the receivers' region; a tenth of
        it evenly by objects, so that a lamp in a closed room is not starved by a sky outside.
    area : (e,) float32, m²
        Over the chance.
    front : (e,) float32
        Share of the photons that leave from the front: 1 or 0 where one side alone emits, otherwise ½.
    density : (t,) float32, 1/m²
        By area, with which a point of each of the scene's triangles is drawn; (0,) without emissive ones.
    """

    triangles: np.ndarray
    table: CutpointTable
    area: np.ndarray
    front: np.ndarray
    density: np.ndarray


def mesh_arrays(scene: Scene, discs: Discs) -> tuple[MeshArrays, np.ndarray]:
    """The emissive triangles, and their power, (3,) float64, W: of both signs together."""
    triangles, by_power, power = emissive_triangles(scene)
    arrives = by_power * _share_that_arrives(scene, triangles, discs)
    _, of = np.unique(scene.object_of_triangle[triangles], return_inverse=True)
    of_object = np.bincount(of, by_power)
    by_object = by_power / np.maximum(of_object, 1e-300)[of] / max(int((of_object > 0).sum()), 1)
    by_arrival = arrives / max(arrives.sum(), 1e-300)
    chance = (1 - _BY_OBJECT) * (by_power + by_arrival) / 2 + _BY_OBJECT * by_object
    areas, density = scene.areas[triangles], np.zeros(scene.n_triangles if len(triangles) else 0, np.float32)
    density[triangles] = chance / areas
    area = (areas / np.maximum(chance, 1e-300)).clip(max=np.finfo(np.float32).max).astype(np.float32)
    table = cutpoint_table(np.cumsum(chance)[None] / max(chance.sum(), 1e-300))
    front = front_shares(scene, triangles)
    return MeshArrays(kernel_array(triangles, np.int32), table, area, front, density), power.sum(axis=0)


def mesh_row(lamp: int, power: np.ndarray) -> SourceRow:
    """How emissive meshes emit photons; `lamp` is the number of lamps."""
    return SourceRow(MESH, lamp, (32, 2, 1, 1, 256), power)


@routine
def emit_mesh(emitters, source, u):
    """A triangle, a place on it, a side, a cosine-weighted direction; from far away many go to the region.

    Returns the origin, off the surface, the direction, the flux and the object.
    """
    scene, mesh, discs = emitters.scene, emitters.mesh, emitters.discs
    aimed, last = halved(emitters.balls, source, u[4])
    # One dimension chooses both side and triangle, so that it stays stratified
    other = last >= np.float32(0.5)
    k = drawn_cell(mesh.table, 0, TWO * last - ONE if other else TWO * last)
    triangle, (a, b) = mesh.triangles[k], uniform_triangle(u[2], u[3])
    origin, front = point_at(scene, triangle, a, b), mesh.front[k]
    normal = row(scene.normals, triangle)
    if front == ZERO or (other and front < ONE):
        normal = negative(normal)
    towards = towards_region(discs.region, discs.region_radius, u[0], origin)
    if towards.goes:
        direction = aimed_direction(towards, u[1])
    else:
        direction = to_world(cosine_hemisphere(towards.u, u[1]), normal)
    cosine = dot(direction, row(scene.normals, triangle))
    share = front if cosine > ZERO else ONE - front
    unaimed = max(abs(cosine) * share, _LEAST_COSINE) / PI
    per_density = per_density_towards(towards, direction, unaimed)
    direction, per_density = redirected(emitters.balls, source, aimed, u[0], u[1], origin, ZERO, direction, per_density)
    normal = row(scene.normals, triangle)
    cosine = dot(direction, normal)
    back = cosine < ZERO
    if back:
        normal, cosine = negative(normal), -cosine
    flux = times(mesh_radiance(scene, triangle, a, b, back), cosine * per_density * mesh.area[k])
    return along(origin, ray_offset(scene, triangle, origin), normal), direction, flux, scene.object[triangle]


@routine
def sample_mesh(scene, mesh, position, choice, u, v):
    """A point of emissive triangles as a position samples it: the triangle by a number `choice`, then uniform by area.

    Returns
    -------
    target, way : triples
        And the unit direction to it.
    light : triple
        L A |cos θ'| / (d² P(triangle)): times cos θ it is the irradiance over the density.
    density : float32, 1/sr
        With which the direction is drawn.
    emitter : int
        The object of the triangle.
    """
    k = drawn_cell(mesh.table, 0, choice)
    triangle, (a, b) = mesh.triangles[k], uniform_triangle(u, v)
    target = point_at(scene, triangle, a, b)
    way, distance = direction_to(position, target)
    cosine, back = abs(dot(way, row(scene.normals, triangle))), is_back(scene, triangle, way)
    density = mesh_density(mesh, triangle, distance, cosine)
    if density <= ZERO or cosine <= ZERO:
        return target, way, BLACK, density, scene.object[triangle]
    light = times(mesh_radiance(scene, triangle, a, b, back), ONE / density)
    return target, way, light, density, scene.object[triangle]


@part
def lights_up(scene, emitter, object_):
    """Whether an emissive object lights an object; what is no object (−1) is lit by all."""
    if len(scene.link_group) == 0 or object_ < 0 or emitter < 0:
        return True
    group = scene.link_group[emitter]
    return group < 0 or scene.illuminates[group, object_]


@routine
def mesh_density(mesh, triangle, distance, cosine):
    """Density by solid angle with which `sample_mesh` draws a direction that meets a triangle: d² p / |cos θ'|."""
    if len(mesh.density) == 0:
        return ZERO
    return mesh.density[triangle] * distance * distance / max(cosine, np.float32(1e-20))


@part
def mesh_radiance(scene, triangle, u, v, back):
    """Radiance that a point of a triangle emits to its back or else its front, with what its coverage leaves of it.

    It is that which diffuse rays see.
    """
    radiance = emitted(scene, triangle, u, v, back, _DIFFUSE_RAY)
    if scene.materials.see_through[scene.material[triangle]]:
        return times(radiance, look_up(scene, scene.materials.coverage, triangle, u, v, back, _DIFFUSE_RAY)[0])
    return radiance


@kernel
def _radiance_of(scene, triangle, u, v, back, radiance):
    for k in range(len(triangle)):
        put(radiance, k, mesh_radiance(scene, triangle[k], u[k], v[k], back))


def radiance_of(
    scene: SceneArrays, triangle: np.ndarray, u: np.ndarray, v: np.ndarray, back: bool = False
) -> np.ndarray:
    """`mesh_radiance` of many on one side, (n, 3) float32, W/(m² sr)."""
    radiance = np.empty((len(triangle), 3), np.float32)
    places = kernel_array(triangle, np.int32), kernel_array(u, np.float32), kernel_array(v, np.float32)
    _radiance_of(scene, *places, back, radiance)
    return radiance


def _share_that_arrives(scene: Scene, triangles: np.ndarray, discs: Discs) -> np.ndarray:
    """Share of all directions that meet the region from where a triangle is nearest to it, (e,)."""
    corners = scene.corners(triangles).astype(np.float64)
    centre, radius = corners.mean(axis=1), float(discs.region_radius)
    reach = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1, initial=0)
    nearest = np.maximum(np.linalg.norm(centre - np.array(discs.region), axis=1) - reach, max(radius, 1e-30))
    sine2 = (radius / nearest) ** 2
    return sine2 / (1 + np.sqrt(1 - sine2)) / 2


def emissive_triangles(scene: Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The triangles that emit: index (e,) int32, chance to be chosen by power (e,), power π|L|A of both sides (e, 3) W.

    The power of textured triangles is a mean over some of their points; a tenth of the chance goes by the brightest
    that they could be, lest none were missed.
    """
    materials = scene.materials
    triangles = np.flatnonzero(scene.shines).astype(np.int32)
    area = 2 * np.pi * scene.areas[triangles, None]
    emission = _mean_emission(scene, triangles, back=False)
    two_faced = np.flatnonzero(materials.two_faced[scene.material_of_triangle[triangles]])
    emission[two_faced] = (emission[two_faced] + _mean_emission(scene, triangles[two_faced], back=True)) / 2
    power = area * emission
    chance = np.abs(power).sum(axis=1)
    chance /= max(chance.sum(), 1e-300)
    if (materials.emission.textured or materials.coverage.textured) and power.any():
        bound = (area * _brightest(scene)[scene.material_of_triangle[triangles]]).sum(axis=1)
        chance = 0.9 * chance + 0.1 * bound / bound.sum()
    return triangles, chance, power


def front_shares(scene: Scene, triangles: np.ndarray) -> np.ndarray:
    """`front` of `MeshArrays`, (e,) float32."""
    emits = scene.materials.emission.nonzero[scene.materials.seen_as[scene.material_of_triangle[triangles], :2]]
    front, back = emits.T
    return np.where(front & back, 0.5, front).astype(np.float32)


def _mean_emission(scene: Scene, triangles: np.ndarray, back: bool) -> np.ndarray:
    """Mean of |L| over a side of triangles, (e, 3) float64, over at least 16 points where they are textured."""
    middle = np.full(len(triangles), 1 / 3, np.float32)
    mean = np.abs(radiance_of(scene.arrays, triangles, middle, middle, back)).astype(np.float64)
    materials = scene.materials
    textured = materials.of_any_view((materials.emission.texture >= 0) | (materials.coverage.texture >= 0))
    varying = np.flatnonzero(textured[scene.material_of_triangle[triangles]])
    n_points = 1 << int(np.clip(np.log2(_N_POINTS / max(len(varying), 1)), 4, 12))
    u, v = sample_uniform_triangle(fixed_points(n_points))
    size = _N_POINTS // n_points
    for chunk in (varying[start : start + size] for start in range(0, len(varying), size)):
        triangle = np.repeat(triangles[chunk], n_points)
        radiance = np.abs(radiance_of(scene.arrays, triangle, np.tile(u, len(chunk)), np.tile(v, len(chunk)), back))
        mean[chunk] = radiance.reshape(len(chunk), n_points, 3).mean(axis=1, dtype=np.float64)
    return mean


def _brightest(scene: Scene) -> np.ndarray:
    """The highest |L| that each material may emit on one of its sides, (m, 3) float32."""
    emission, textures = scene.materials.emission, scene.materials.textures
    brightest = np.abs(emission.value)
    if emission.textured:
        textured = emission.texture >= 0
        brightest[textured] *= np.maximum.reduceat(np.abs(textures.pixels), textures.offset)[emission.texture[textured]]
    return brightest[scene.materials.seen_as[:, :2]].max(axis=1)
