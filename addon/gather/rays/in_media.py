"""Gather rays in media: where one scatters a ray, it takes the direct light there and goes on.

    L(x, ω) = ∫ T(x, y) σs(y) ∫ p(ω' · ω) Li(y, ω') dω' dy

over the points y on the ray. For light that comes to y straight from a lamp, y is drawn by the angle at which the lamp
sees it and the phase function (`lamp_angles`). Of other light y is where media scatter the ray (`tracing.media`): there
one point of an emitter is asked for light, and a direction by the phase function p brings the rest.
"""

import numpy as np

from ...core.compiling import part, routine
from ...core.sampling.path_numbers import two_numbers
from ...core.vec3 import BLACK, ONE, ZERO, along, direction_to, dot, largest, mul, plus, times
from ...emitters.lamps import sample_lamp
from ...tracing.media.flight import fly, media_left, scattering_at, span_of_media
from ...tracing.media.scattering import phase_density, sample_phase
from ...tracing.transparency import closest_hit
from ..direct.lamp_choice import cell_of, choose_lamp
from ..direct.sampling import DIFFUSE_RAY, IN_AIR, met_radiance, sample_emitters
from ..direct.visible import visible_share
from .lamp_angles import place_on_ray

_NO_OBJECT = -1
_STREAM = np.uint64(0x8BB84B93962EACC9)  # of the numbers of a path, beside those for surfaces
_LAMP, _EMITTER = 2, 4  # the first pairs of numbers that draw a lamp, and another emitter; those before send the ray on
_KIND = np.int64(DIFFUSE_RAY)  # of rays that a medium scattered
_HALF = np.float32(0.5)


@routine
def through_media(tracing, room, light, key, path, i, ray):
    """What media on the way of a ray bring onto it, and the ray that is left.

    Parameters
    ----------
    light : RayLight
    i : int
        The first of the path's pairs of numbers that the surface at the end of the ray would take.
    ray
        As that of `radiance_along`.

    Returns
    -------
    scattered : bool
        Whether a medium sends the ray elsewhere; its end is that on the new way, then.
    radiance : triple, W/(m² sr)
    ray
    """
    origin, direction, kind, triangle, distance, u, v, throughput = ray
    key ^= _STREAM
    lamplight = _lamplight_scattered(tracing, room, light.direct, key, path, i + _LAMP, origin, direction, distance)
    radiance = mul(throughput, lamplight)
    flight = fly(tracing, room, origin, direction, distance)
    throughput = mul(throughput, flight.weight)
    if flight.volume < 0:
        return False, radiance, (origin, direction, kind, triangle, distance, u, v, throughput)
    origin, volume = along(origin, flight.distance, direction), flight.volume
    lit = _emission_scattered(tracing, room, light.others, key, path, i + _EMITTER, origin, direction, volume)
    radiance = plus(radiance, mul(throughput, lit))
    a, b = two_numbers(key, path, i)
    fate, _ = two_numbers(key, path, i + 1)
    survival = min(largest(throughput), ONE)
    if fate >= survival:
        return True, radiance, (origin, direction, _KIND, triangle, distance, u, v, BLACK)
    direction = sample_phase(tracing.media, volume, direction, a, b)
    triangle, distance, u, v, tint = closest_hit(tracing, room, origin, direction, DIFFUSE_RAY)
    throughput = times(mul(throughput, tint), ONE / survival)
    met = met_radiance(light.others, tracing.scene, triangle, distance, u, v, direction, IN_AIR, _NO_OBJECT)
    if met != BLACK:
        left = media_left(tracing, room, origin, direction, distance)
        radiance = plus(radiance, mul(throughput, mul(left, met)))
    return True, radiance, (origin, direction, _KIND, triangle, distance, u, v, throughput)


@part
def _lamplight_scattered(tracing, room, direct, key, path, i, origin, direction, far):
    """What media scatter onto a ray of the light of lamps, by one lamp, one point of it and one of the ray."""
    start, end = span_of_media(tracing.media, origin, direction, far)
    if direct.lamp_chance == ZERO or start >= end:
        return BLACK
    choice, place = two_numbers(key, path, i)
    middle = along(origin, _HALF * (start + min(end, start + direct.far)), direction)
    lamp, chance = choose_lamp(direct.grid, cell_of(direct.grid, middle), choice)
    if not direct.lamps.seen[DIFFUSE_RAY, lamp]:
        return BLACK
    distance, density = place_on_ray(tracing.media, direct.lamps, lamp, origin, direction, start, end, place)
    x, (u, v) = along(origin, distance, direction), two_numbers(key, path, i + 1)
    target, light = sample_lamp(direct.lamps, lamp, x, IN_AIR, u, v, direct.far)
    if light == BLACK or density <= ZERO:
        return BLACK
    towards, _ = direction_to(x, target)
    share = scattering_at(tracing, room, origin, direction, distance, dot(towards, direction))
    if share == BLACK:
        return BLACK
    passes = visible_share(direct, tracing, room, lamp, x, target)
    return times(mul(mul(light, share), passes), ONE / (chance * density))


@part
def _emission_scattered(tracing, room, others, key, path, i, x, direction, volume):
    """What a volume scatters at a point of the light of meshes and worlds; what rays own of it comes with them."""
    at = x, IN_AIR, _NO_OBJECT, DIFFUSE_RAY
    target, light, emitter, lit = sample_emitters(others, tracing.scene, *at, True, key, path, i)
    if not lit:
        return BLACK
    towards, _ = direction_to(x, target)
    passes = visible_share(others, tracing, room, emitter, x, target)
    return times(mul(light, passes), phase_density(tracing.media, volume, dot(towards, direction)))
