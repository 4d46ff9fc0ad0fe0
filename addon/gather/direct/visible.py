"""Shadow rays towards emitters, and direct light with them: one estimate of the irradiance at a point."""

from ...core.compiling import part
from ...core.sampling.path_numbers import two_numbers
from ...core.sampling.warps import PI, cosine_hemisphere
from ...core.vec3 import BLACK, direction_to, minus, mul, times, to_world
from ...scene import RayKind
from ...tracing.embree import SHORT_OF_TARGET
from ...tracing.media.flight import media_left
from ...tracing.transparency import closest_hit, transmittance, visibility
from .sampling import DIFFUSE_RAY, N_PAIRS, met_radiance, sample_emitters, unsampled_sky

N_PAIRS_OF_LIGHT = N_PAIRS + 1
"""Pairs of a path's numbers that `arriving` uses up."""

_SHADOW = int(RayKind.SHADOW)


@part
def visible_share(direct, tracing, room, lamp, position, target):
    """Share of the light of an emitter's point that reaches a position, by what keeps that emitter's light away."""
    passes = _past_surfaces(direct, tracing, room, lamp, position, target)
    if tracing.media.any and passes != BLACK:
        way, distance = direction_to(position, target)
        passes = mul(passes, media_left(tracing, room, position, way, distance))
    return passes


@part
def _past_surfaces(direct, tracing, room, lamp, position, target):
    """The share that surfaces leave."""
    if lamp >= len(direct.has_blockers) or not direct.has_blockers[lamp]:
        return visibility(tracing, room, position, target)
    way, distance = direction_to(position, target)
    return transmittance(
        tracing, room, position, way, distance * SHORT_OF_TARGET, direct.blockers[lamp], _SHADOW, False
    )


@part
def arriving(direct, tracing, room, position, normal, object_, key, path, i, with_sky=False):
    """One estimate of the direct irradiance at a point, W/m², in two parts: by a point of an emitter, and by a ray.

    Parameters
    ----------
    position, normal, object_
        As for `sample_emitters`.
    i : int
        The first of `N_PAIRS_OF_LIGHT` pairs of the path's numbers.
    with_sky : bool
        With the light of a constant world.

    Returns
    -------
    towards, light, direction, met : triples
        Where each part comes from, undefined where it is black, and its irradiance.
    """
    at = position, normal, object_, DIFFUSE_RAY
    target, light, lamp, lit = sample_emitters(direct, tracing.scene, *at, True, key, path, i)
    if lit:
        light = mul(light, visible_share(direct, tracing, room, lamp, position, target))
    towards, _ = direction_to(position, target)
    if not with_sky and direct.mesh_chance == 0 and direct.world_chance == 0:
        return towards, light, normal, BLACK
    u, v = two_numbers(key, path, i + N_PAIRS)
    direction = to_world(cosine_hemisphere(u, v), normal)
    triangle, distance, a, b, tint = closest_hit(tracing, room, position, direction, DIFFUSE_RAY)
    met = met_radiance(direct, tracing.scene, triangle, distance, a, b, direction, normal, object_)
    if not with_sky and triangle < 0:
        met = minus(met, unsampled_sky(direct, DIFFUSE_RAY))
    if tracing.media.any and met != BLACK:
        met = mul(met, media_left(tracing, room, position, direction, distance))
    return towards, light, direction, times(mul(tint, met), PI)
