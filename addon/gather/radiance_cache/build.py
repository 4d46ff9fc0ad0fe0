"""How the radiance cache is made: direct light by next-event estimation, and photons for all the rest.

A photon counts for the element it fell on, whose area is known exactly: no search radius, no boundary bias, no leaking.
What remains is noise, and the light's variation within an element, which is why elements are small where many gather
rays end. Where the noise matters, elements gather once themselves, so that receivers see photons two bounces removed.
"""

import numpy as np

from ...bsdf.frames import bump_shadowing
from ...bsdf.scatter import lambertian_normal
from ...core.compiling import kernel, part
from ...core.parallel import Workers
from ...core.sampling.path_numbers import path_key, two_numbers
from ...core.sampling.warps import cosine_hemisphere
from ...core.vec3 import BLACK, ONE, TWO, ZERO, dot, minus, mul, plus, put, row, times, to_world
from ...photons import Photons
from ...scene import RayKind, Scene
from ...scene.hit import off_surface, shading_normal
from ...tracing import TransparencyTracer
from ..direct.direct_light import DirectLight
from ..direct.ray_directions import shifted, stratified_set
from ..rays.gather_rays import GatherRays
from .elements import SurfaceElements
from .hidden_sides import HiddenSides, is_hidden
from .importance_pilot import ImportancePilot
from .lit_sides import lit_sides, point_of_side
from .photon_radiance import photon_incidence, photon_radiance
from .radiance_cache import RadianceCache

_REFINE = 13  # stream of random numbers
_CHUNK = 1 << 14  # rays
_SHIFT, _POINT = 1 << 15, (1 << 15) + 1  # of a path's pairs of numbers, those for directions and for points of sides
_FATE = (1 << 15) + 3  # and for what bumps shadow


def build_radiance_cache(
    scene: Scene,
    tracer: TransparencyTracer,
    photons: Photons,
    direct: DirectLight,
    pilot: ImportancePilot,
    n_rays: int,
    workers: Workers,
    beyond: GatherRays | None = None,
) -> RadianceCache:
    """A radiance cache of the elements of an importance pilot.

    Parameters
    ----------
    photons : Photons
        With direct photons of those sources only that `direct` does not sample.
    n_rays : int
        Rays that each side seen from the receivers gathers with, from the cache of photons and direct light; 0 leaves
        the photons as they are.
    beyond : GatherRays, optional
        That they gather with instead, where light is cut off after some bounces.
    """
    elements, hidden = pilot.elements, pilot.hidden.unlit(scene, photons)
    # Light them by the lamps and by photons
    sides = lit_sides(scene, tracer, direct, elements, pilot.seen, hidden, workers)
    caustic, others = photon_radiance(scene, photons, elements, sides.coverage)
    lit = sides.radiance + others + caustic
    incident = (lit[:0], lit[:0])
    if scene.materials.broad.any() or scene.materials.subsurface.any():
        incident = photon_incidence(scene, photons, elements, sides.coverage)
    unresolved = _unresolved(scene, elements)
    arriving = sides.with_direct(incident[0])
    cache = RadianceCache(elements, lit, caustic, *incident, arriving, unresolved)
    if n_rays == 0:
        return cache

    # Let those that are seen gather once
    k = np.flatnonzero(pilot.seen)
    rays = beyond or GatherRays(scene, tracer, direct, cache)
    gathered = np.zeros_like(lit)
    gathered[k] = gather_at_sides(scene, rays, elements, hidden, k, n_rays, workers)
    lit[k] = (sides.radiance + caustic + sides.gathering(gathered))[k]
    if len(incident[0]):
        incident[0][k] = gathered[k] + incident[1][k]
    return RadianceCache(elements, lit, caustic, *incident, sides.with_direct(incident[0]), unresolved)


def _unresolved(scene: Scene, elements: SurfaceElements) -> np.ndarray | None:
    """Elements of hair and points, (e,) bool: they are the mean of what is seen and of what lies deep in it."""
    fibrous = scene.objects.fibrous
    return None if fibrous is None else elements.of_cells(fibrous[scene.object_of_triangle[elements.cells.triangle]])


def gather_at_sides(
    scene: Scene,
    rays: GatherRays,
    elements: SurfaceElements,
    hidden: HiddenSides,
    sides: np.ndarray,
    n_rays: int,
    workers: Workers,
) -> np.ndarray:
    """Mean radiance (E/π) from the cache and the world at each of `sides`, (n, 3): a ray from a new point each time.

    Points inside of something do not count.
    """
    key, gathered = path_key(workers.seed, _REFINE), np.zeros((len(sides), 3), np.float32)
    points, at, world = stratified_set(n_rays), (scene.arrays, elements.arrays), scene.world
    unseen = world.image is not None or RayKind.DIFFUSE in world.hidden_from
    sky = np.zeros(3, np.float32) if unseen else world.color

    def gather(chunk: slice, _: np.random.Generator) -> None:
        some, first = sides[chunk], chunk.start * n_rays
        origins, directions, normals = np.empty((3, len(some) * n_rays, 3), np.float32)
        _start(*at, some, points, key, first, origins, directions, normals)
        met = rays.radiance_of_paths(origins, directions, key, first)
        hits = rays.tracer.dimmed(met.hits, origins, directions)
        tint = np.ones_like(origins) if hits.tint is None else hits.tint
        where = hits.triangle, tint, directions, normals
        _mean(scene.arrays, hidden.of_object, sky, *where, met.reflected, gathered[chunk])

    for _ in workers.chunks("Refining light", len(sides), max(1, _CHUNK // n_rays), gather, (_REFINE,)):
        pass
    return gathered


@kernel
def _start(scene, elements, sides, points, key, first, origins, directions, normals):
    """Rays from sides, one from each of `len(points)` random points of them; and their geometric normals."""
    n = len(points)
    for ray in range(len(origins)):
        path = first + ray
        hit = point_of_side(scene, elements, sides[ray // n], key, path, _POINT)
        a, b = two_numbers(key, path - ray % n, _SHIFT)
        u, v = shifted(points, ray % n, a, b)
        put(origins, ray, off_surface(scene, hit, ONE))
        direction = to_world(cosine_hemisphere(u, v), lambertian_normal(scene, hit))
        fate, _ = two_numbers(key, path, _FATE)
        put(directions, ray, _unless_shadowed(scene, hit, direction, fate))
        put(normals, ray, hit.normal)


@part
def _unless_shadowed(scene, hit, direction, fate):
    """A direction from a surface, turned into it with the probability that bumps shadow the light from there."""
    if not scene.materials.perturbed[scene.material[hit.triangle]]:
        return direction
    shading = shading_normal(scene, hit)
    if fate < bump_shadowing(shading, lambertian_normal(scene, hit), direction):
        return direction
    height = max(dot(direction, hit.normal), ZERO)
    return minus(direction, times(hit.normal, TWO * height))


@kernel
def _mean(scene, hidden, sky, triangle, tint, directions, normals, reflected, gathered):
    """Means of what the rays of sides met that start outside of things; from behind their facets comes nothing."""
    n = len(triangle) // len(gathered)
    for side in range(len(gathered)):
        sum_, outside = BLACK, 0
        for ray in range(side * n, side * n + n):
            direction, met = row(directions, ray), triangle[ray]
            if met >= 0 and is_hidden(scene, hidden, met, dot(row(scene.normals, met), direction) > ZERO):
                continue
            outside += 1
            if dot(direction, row(normals, ray)) > ZERO:
                sum_ = plus(sum_, row(reflected, ray))
                if met < 0:
                    sum_ = plus(sum_, mul(row(tint, ray), (sky[0], sky[1], sky[2])))
        put(gathered, side, times(sum_, ONE / np.float32(max(outside, 1))))
