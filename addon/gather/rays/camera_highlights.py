"""Direct light that gloss and rough glass reflect where a camera sees them in mirrors or through glass: highlights.

Points of lamps find small lights well, rays by the lobe large ones. Each light in each direction is left to the way
that finds it more often (the maximum heuristic: Veach 1997, 9.2.4): lamps by their densities, emissive meshes and
worlds, whose points `DirectLight` draws together, by whether the lobe is a peak there.
"""

import numpy as np

from ...bsdf.closure import bsdf_at
from ...bsdf.mixture import NARROW_LOBES, evaluate_glossy, evaluate_glossy_below_peak, pdf_glossy
from ...bsdf.scatter import axis_at, scatter
from ...core.compiling import kernel, part
from ...core.parallel import Workers
from ...core.sampling.path_numbers import two_numbers
from ...core.vec3 import BLACK, ONE, ZERO, direction_to, largest, mul, negative, plus, put, row, to_local
from ...emitters.lamps import meet_lamp, radiance_of_lamps
from ...emitters.mesh import lights_up
from ...emitters.world import world_seen
from ...receivers import CameraPoints
from ...scene import RayKind, Scene
from ...scene.hit import emitted, hit_at, is_back, off_surface
from ...tracing import TransparencyTracer
from ...tracing.embree import new_ray
from ...tracing.media.flight import media_left
from ...tracing.transparency import closest_hit
from ..direct.direct_light import DirectLight
from ..direct.sampling import GLOSSY_RAY, sample_emitters
from ..direct.visible import visible_share
from .lobe_rays import mean_over_rays, ray_counts

_LEAST_RAYS = 8  # of a point: highlights are bright however little gloss there is
_HIGHLIGHTS = 76  # stream of random numbers
_CAMERA = int(RayKind.CAMERA)
_INFINITY = np.float32(np.inf)


def reflected_highlights(
    scene: Scene, points: CameraPoints, direct: DirectLight, tracer: TransparencyTracer, n_rays: int, workers: Workers
) -> tuple[np.ndarray, np.ndarray]:
    """Radiance by direct light on glossy and glass lobes that are seen in mirrors or through glass, as pixels get it.

    Parameters
    ----------
    n_rays : int
        And as many points of lights, of a point that reflects everything; others have fewer in proportion.

    Returns
    -------
    radiance : (n, 3) float32, W/(m² sr)
        0 for what the camera itself sees.
    stderr : (n,) float32, W/(m² sr)
        Of its mean over colours.
    """
    radiance, stderr = np.zeros((len(points), 3), np.float32), np.zeros(len(points), np.float32)
    narrow = scene.materials.narrow[scene.material_of_triangle[points.seen.hits.triangle]]
    point = np.flatnonzero(narrow & (points.n_followed > 0))
    if len(point) == 0:
        return radiance, stderr
    counts = ray_counts(scene, points, point, n_rays, _LEAST_RAYS)

    seen = points.seen
    at = tracer.arrays, direct.arrays, seen.hits.triangle, seen.hits.u, seen.hits.v, seen.direction

    def light(of_ray: np.ndarray, key: np.uint64, first: int) -> np.ndarray:
        k, found = point[of_ray], np.empty((len(of_ray), 3), np.float32)
        _find(*at, new_ray(), k, key, first, found)
        return points.tint[k] * found

    radiance[point], stderr[point] = mean_over_rays(counts, light, "Highlights in mirrors", _HIGHLIGHTS, workers)
    return radiance, stderr


@kernel
def _find(tracing, direct, triangle, u, v, direction, room, point, key, first, found):
    """What one point of lights and one ray by the lobes find at each of those surfaces `point` (n,), W/(m² sr)."""
    for ray in range(len(point)):
        k, path = point[ray], first + ray
        hit = hit_at(tracing.scene, row(direction, k), triangle[k], ZERO, u[k], v[k])
        at = tracing, room, direct, hit, row(direction, k), key, path
        put(found, ray, plus(_by_points_of_lights(*at), _by_rays(*at)))


@part
def _by_points_of_lights(tracing, room, direct, hit, direction, key, path):
    """What a point of a light gives that rays by the rough glossy lobes find less often."""
    scene = tracing.scene
    origin, normal = off_surface(scene, hit, ONE), axis_at(scene, hit, direction)
    at = origin, normal, scene.object[hit.triangle], GLOSSY_RAY
    target, irradiance, lamp, lit = sample_emitters(direct, scene, *at, False, key, path, 4)
    if not lit:
        return BLACK
    towards, _ = direction_to(origin, target)
    bsdf, wo, wi = bsdf_at(scene, hit, _CAMERA), to_local(negative(direction), normal), to_local(towards, normal)
    if lamp < len(direct.lamps.kind):
        _, _, density = meet_lamp(direct.lamps, lamp, origin, towards)
        f = evaluate_glossy(scene, bsdf, wo, wi) if pdf_glossy(scene, bsdf, wo, wi) <= density else BLACK
    else:
        f = evaluate_glossy_below_peak(scene, bsdf, wo, wi)
    if largest(f) <= ZERO:
        return BLACK
    return mul(mul(f, irradiance), visible_share(direct, tracing, room, lamp, origin, target))


@part
def _by_rays(tracing, room, direct, hit, direction, key, path):
    """What a ray by the lobes meets that is left to it."""
    scene = tracing.scene
    choice, _ = two_numbers(key, path, 0)
    a, b = two_numbers(key, path, 1)
    on = scatter(scene, hit, direction, choice, a, b, NARROW_LOBES, False, _CAMERA)
    if not on.alive:
        return BLACK
    least_density = _INFINITY
    if on.rough:
        normal = axis_at(scene, hit, direction)
        wo, wi = to_local(negative(direction), normal), to_local(on.direction, normal)
        least_density = pdf_glossy(scene, bsdf_at(scene, hit, _CAMERA), wo, wi)
    triangle, distance, u, v, tint = closest_hit(tracing, room, on.origin, on.direction, on.kind)
    object_ = scene.object[hit.triangle]
    met = radiance_of_lamps(direct.lamps, on.origin, on.direction, distance, on.kind, object_, least_density)
    if triangle < 0 and (on.specular or direct.world.height == 0):
        met = plus(met, world_seen(direct.world, on.direction, on.kind))
    elif triangle >= 0 and on.specular and lights_up(scene, scene.object[triangle], object_):
        met = plus(met, emitted(scene, triangle, u, v, is_back(scene, triangle, on.direction), on.kind))
    if tracing.media.any and met != BLACK:
        met = mul(met, media_left(tracing, room, on.origin, on.direction, distance))
    return mul(mul(on.weight, tint), met)
