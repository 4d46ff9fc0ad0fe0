"""The way of one gather ray, and the radiance that it meets.

A ray that ends far away takes what the surface there reflects diffusely from the cache. Three things are found as a
path tracer would find them, by direct light at the point and a further ray for the rest:

- What ends nearer than the cache can resolve (in a corner, under a cupboard), where it would read an element that is
  partly elsewhere (the secondary final gather of the π-engine, section 3.2.2).
- What ends on hair or points, of which an element has the mean of what is seen and of what lies deep in them.
- What glossy and glass lobes reflect and transmit, which depends on the direction. Rays follow them in proportion to
  their albedo. Light that lamps send over mirrors, glass and narrow gloss is left out: those are caustics, which
  photons find far better. Where there are none, in what a camera sees in gloss, rays may be told to bring it.

Of broad lobes that are not Lambertian direct light is found at the point. The rest is what comes to the surface, by the
cache, times the albedo of rough diffuse lobes; directed ones, as sheen, are followed as gloss is, and take from there
caustics alone.

What walked through a body is looked for by a walk from where the ray ends (`through_bodies`). Media on the way may
scatter the ray (`in_media`), which counts as a surface that it met.
"""

from typing import NamedTuple

import numpy as np

from ...bsdf.albedos import (
    base_transmittance,
    broad_albedo,
    glass_albedo,
    glossy_albedo,
    reflects_highlights,
    total_weight,
    weight_received,
)
from ...bsdf.closure import bsdf_at, has_lobes, seen_otherwise
from ...bsdf.mixture import (
    ALL_LOBES,
    BROAD_LOBES,
    DIFFUSE,
    DIRECTED_LOBES,
    GLOSSY,
    NARROW_LOBES,
    SUBSURFACE,
    TRANSLUCENT,
    evaluate_direct,
)
from ...bsdf.scatter import axis_at, lit_normal, scatter
from ...core.compiling import by_reference, part
from ...core.sampling.path_numbers import two_numbers
from ...core.vec3 import BLACK, ONE, TWO, ZERO, direction_to, largest, mul, negative, plus, row, times, to_local
from ...emitters.lamps import radiance_of_lamps
from ...emitters.mesh import lights_up
from ...emitters.world import world_seen
from ...scene import RayKind
from ...scene.hit import emitted, hit_at, is_back, off_surface
from ...tracing.bodies.through import walk_key
from ...tracing.media.flight import media_left
from ...tracing.transparency import closest_hit
from ..direct.sampling import DIFFUSE_RAY, GLOSSY_RAY, DirectArrays, met_radiance, sample_emitters, unsampled_sky
from ..direct.visible import visible_share
from ..radiance_cache.radiance_cache import CacheArrays, side_at
from .in_media import through_media
from .through_bodies import seen_through_body

_MAX_NEAR_HITS = 4
MAX_STEPS = 33
"""Surfaces that a ray meets at most."""

_LATE_SURVIVAL = np.float32(0.5)  # after the first few hits: a long tail of few paths brings little
_FOLLOWED = TWO
"""Rays that follow a narrow lobe, over its albedo: more of them cost time, fewer make noise."""

_CACHED_LOBES = 1 << DIFFUSE | 1 << TRANSLUCENT | BROAD_LOBES
_FOLLOWED_LOBES = NARROW_LOBES | DIRECTED_LOBES
_NUMBERS_A_STEP = 40  # pairs of a path's numbers
_DIFFUSE_LIGHT, _GLOSSY_LIGHT = 3, 20  # the first of those that draw lights
_PER_PI, _INFINITY = np.float32(1 / np.pi), np.float32(np.inf)
_GATHER_RAY = int(RayKind.GATHER)


@by_reference
class RayLight(NamedTuple):
    """What gather rays bring: the cache, and direct light for where that is not asked; in media that without lamps."""

    cache: CacheArrays
    direct: DirectArrays
    others: DirectArrays


@part
def radiance_along(tracing, room, light, key, path, first_step, last_step, ray, specular):
    """Radiance that a ray meets on surfaces, W/(m² sr), and over them in the world; and the ray that is left.

    Parameters
    ----------
    light : RayLight
    first_step, last_step : int
        Surfaces that the ray has met before, and at most meets.
    ray : (origin, direction, kind, triangle, distance, u, v, throughput)
        The next surface that it meets, as `closest_hit` has it, and what is left of the light on its way back.
    specular : bool
        Bring also what mirrors, glass and narrow gloss show of lamps, emission and worlds.
    """
    origin, direction, kind, triangle, distance, u, v, throughput = ray
    scene, cache, radiance = tracing.scene, light.cache, BLACK
    for step in range(first_step, last_step):
        if tracing.media.any and largest(throughput) > ZERO:
            way = origin, direction, kind, triangle, distance, u, v, throughput
            scattered, met, way = through_media(tracing, room, light, key, path, step * _NUMBERS_A_STEP, way)
            origin, direction, kind, triangle, distance, u, v, throughput = way
            radiance = plus(radiance, met)
            if scattered:
                continue
        if triangle < 0 or largest(throughput) <= ZERO:
            break
        # What broad lobes reflect the cache says, but not to those who are too near, or see another surface
        back, directional = is_back(scene, triangle, direction), scene.materials.directional[scene.material[triangle]]
        otherwise, side = seen_otherwise(scene, triangle, back, kind), side_at(cache, triangle, u, v, back)
        reach = cache.reach[side >> 1]
        near = (step < _MAX_NEAR_HITS and (distance < reach or otherwise)) or reach == _INFINITY
        if not (near or directional):
            radiance, triangle = plus(radiance, mul(throughput, row(cache.radiance, side))), np.int32(-1)
            break
        i, hit = step * _NUMBERS_A_STEP, hit_at(scene, direction, triangle, distance, u, v)
        bsdf = bsdf_at(scene, hit, kind)
        near = near and _only_reflects(scene, bsdf)
        broad = _diffusely_reflected(tracing, room, light, key, path, i, hit, bsdf, side, near, otherwise)
        chance = ONE if near else ZERO  # of going on
        if directional:
            of_point = light, key, path, i, hit, bsdf, side, direction, near
            broad, followed = _with_other_lobes(tracing, room, *of_point, broad)
            if scene.materials.subsurface[scene.material[triangle]]:
                walk = walk_key(key, step), path, hit, bsdf, direction
                broad = plus(broad, seen_through_body(tracing, room, cache, *walk))
            if not near:
                chance = min(_FOLLOWED * followed * min(largest(throughput), ONE), ONE)
        radiance = plus(radiance, mul(throughput, broad))

        # On, by those lobes that are not answered for
        triangle = np.int32(-1)
        if chance <= ZERO:
            break
        choice, follow = two_numbers(key, path, i)
        if follow >= chance:
            break
        a, b = two_numbers(key, path, i + 1)
        on = scatter(scene, hit, direction, choice, a, b, ALL_LOBES if near else _FOLLOWED_LOBES, False, kind)
        throughput = times(mul(throughput, on.weight), ONE / chance)
        fate, _ = two_numbers(key, path, i + 2)
        survival = min(largest(throughput), ONE if step < _MAX_NEAR_HITS else _LATE_SURVIVAL)
        if not on.alive or fate >= survival:
            break
        # What gather rays alone see no photons have left, so that mirrors and gloss are theirs
        shows = specular or (otherwise and kind == _GATHER_RAY)
        kind = np.int64(on.kind)
        triangle, distance, u, v, tint = closest_hit(tracing, room, on.origin, on.direction, on.kind)
        origin, direction, throughput = on.origin, on.direction, times(mul(throughput, tint), ONE / survival)
        shining = _emission_met(tracing, room, light.direct, hit, on, triangle, distance, u, v, shows)
        radiance = plus(radiance, mul(throughput, shining))
    return radiance, (origin, direction, kind, triangle, distance, u, v, throughput)


@part
def _diffusely_reflected(tracing, room, light, key, path, i, hit, bsdf, side, near, otherwise):
    """What a surface reflects diffusely: near ones of direct light and caustics, others all that the cache has."""
    if near:
        at = light.direct, key, path, i + _DIFFUSE_LIGHT, hit, bsdf
        return plus(_direct_light_reflected(tracing, room, *at), row(light.cache.caustic, side))
    if otherwise and not has_lobes(tracing.scene, bsdf, _CACHED_LOBES):
        return BLACK
    return row(light.cache.radiance, side)


@part
def _with_other_lobes(tracing, room, light, key, path, i, hit, bsdf, side, direction, near, lambertian):
    """What all lobes reflect that the cache or direct light answers for, and the albedo of those that rays follow."""
    scene, cache = tracing.scene, light.cache
    wo, directed = to_local(negative(direction), axis_at(scene, hit, direction)), BLACK
    spreads = scene.materials.broad[scene.material[hit.triangle]]
    reflected = mul(lambertian, base_transmittance(scene, bsdf, wo))
    if spreads:
        caustic, directed = row(cache.incident_caustic, side), broad_albedo(scene, bsdf, wo, DIRECTED_LOBES)
        incident = caustic if near else row(cache.incident, side)
        reflected = plus(reflected, mul(broad_albedo(scene, bsdf, wo, ~DIRECTED_LOBES), incident))
        reflected = plus(reflected, mul(directed, caustic))
    # Highlights are bright, however little gloss there is on average
    if spreads or reflects_highlights(scene, bsdf):
        seen = light.direct, key, path, i + _GLOSSY_LIGHT, hit, bsdf, direction
        reflected = plus(reflected, _highlight(tracing, room, *seen))
    followed = ZERO
    if not near:
        followed = largest(glossy_albedo(scene, bsdf, wo)) + largest(glass_albedo(scene, bsdf)) + largest(directed)
    return reflected, followed


@part
def _only_reflects(scene, bsdf):
    """Whether a surface reflects diffusely, and nothing shines through it: that is lit from its other side, or through
    its body, and only the cache knows both.
    """
    materials, material = scene.materials, scene.material[bsdf.triangle]
    if materials.subsurface[material] and has_lobes(scene, bsdf, 1 << SUBSURFACE):
        return False
    reflects = largest(total_weight(scene, bsdf, DIFFUSE)) > ZERO or materials.broad[material]
    return reflects and (materials.matte[material] or largest(total_weight(scene, bsdf, TRANSLUCENT)) <= ZERO)


@part
def _direct_light_reflected(tracing, room, direct, key, path, i, hit, bsdf):
    """Direct light that the diffuse lobe reflects; what rays own of it comes with the next ray."""
    scene = tracing.scene
    origin, object_ = off_surface(scene, hit, ONE), scene.object[hit.triangle]
    at = origin, lit_normal(scene, hit), object_, DIFFUSE_RAY
    target, irradiance, lamp, lit = sample_emitters(direct, scene, *at, True, key, path, i)
    if not lit:
        return BLACK
    towards, _ = direction_to(origin, target)
    albedo = weight_received(scene, bsdf, DIFFUSE, towards)
    passes = visible_share(direct, tracing, room, lamp, origin, target)
    return mul(mul(albedo, passes), times(irradiance, _PER_PI))


@part
def _highlight(tracing, room, direct, key, path, i, hit, bsdf, direction):
    """Direct light that rough glossy lobes and broad ones reflect that are not Lambertian."""
    scene = tracing.scene
    origin, object_ = off_surface(scene, hit, ONE), scene.object[hit.triangle]
    normal = axis_at(scene, hit, direction)
    at = origin, normal, object_, GLOSSY_RAY
    target, irradiance, lamp, lit = sample_emitters(direct, scene, *at, False, key, path, i)
    if not lit:
        return BLACK
    towards, _ = direction_to(origin, target)
    wi, wo = to_local(towards, normal), to_local(negative(direction), normal)
    reflected = mul(evaluate_direct(scene, bsdf, wo, wi), irradiance)
    if largest(reflected) <= ZERO:
        return BLACK
    return mul(reflected, visible_share(direct, tracing, room, lamp, origin, target))


@part
def _emission_met(tracing, room, direct, hit, on, triangle, distance, u, v, specular):
    """What shines along a ray that a surface sent on and that is not found by points of lights."""
    shining = _shining(tracing.scene, direct, hit, on, triangle, distance, u, v, specular)
    if tracing.media.any and shining != BLACK:
        shining = mul(shining, media_left(tracing, room, on.origin, on.direction, distance))
    return shining


@part
def _shining(scene, direct, hit, on, triangle, distance, u, v, specular):
    """The same before media take of it."""
    object_ = scene.object[hit.triangle]
    if on.lobe < GLOSSY:
        normal = lit_normal(scene, hit)
        if on.lobe == TRANSLUCENT:
            normal = negative(normal)
        return met_radiance(direct, scene, triangle, distance, u, v, on.direction, normal, object_)
    if specular and on.specular:
        shining = _seen(scene, direct, triangle, u, v, on, object_)
        at = on.origin, on.direction, distance, on.kind, object_
        return plus(shining, radiance_of_lamps(direct.lamps, *at, _INFINITY))
    if triangle < 0:
        return unsampled_sky(direct, on.kind)
    if scene.materials.emits_unsampled[scene.material[triangle]]:
        return _seen(scene, direct, triangle, u, v, on, object_)
    return BLACK


@part
def _seen(scene, direct, triangle, u, v, on, object_):
    """What a ray from an object sees of a triangle's emission, or of the world."""
    if triangle < 0:
        return world_seen(direct.world, on.direction, on.kind)
    if not lights_up(scene, scene.object[triangle], object_):
        return BLACK
    return emitted(scene, triangle, u, v, is_back(scene, triangle, on.direction), on.kind)
