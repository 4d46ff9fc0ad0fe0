"""What a gather ray sees of the light that walked through a body: a walk from where it ends (see `bsdf.subsurface`)."""

from ...bsdf.frames import frame_of, into, out_of
from ...bsdf.mixture import SUBSURFACE, transmittance_to
from ...bsdf.scatter import axis_at
from ...bsdf.subsurface.interface import enter
from ...bsdf.subsurface.medium import medium_at
from ...core.compiling import routine
from ...core.sampling.path_numbers import two_numbers
from ...core.vec3 import BLACK, ZERO, dot, mul, negative, plus, row, to_local, to_world
from ...scene.hit import channel_at
from ...tracing.bodies.through import exit_of, outside_of
from ...tracing.bodies.walk import N_PAIRS
from ..radiance_cache.radiance_cache import side_at


@routine
def seen_through_body(tracing, room, cache, key, path, hit, bsdf, direction):
    """Radiance by one walk of each subsurface closure at a hit, W/(m² sr), towards where a ray came from."""
    scene, closures, total = tracing.scene, tracing.scene.materials.closures, BLACK
    axis = axis_at(scene, hit, direction)
    wo = to_local(negative(direction), axis)
    choice, u = two_numbers(key, path, N_PAIRS)
    v, _ = two_numbers(key, path, N_PAIRS + 1)
    for k in range(bsdf.first, bsdf.last):
        if closures.kind[k] != SUBSURFACE:
            continue
        medium, frame = medium_at(scene, k, hit.triangle, hit.u, hit.v), frame_of(scene, bsdf, k, wo)
        own_wo = into(frame, wo)
        if own_wo[2] <= ZERO:
            continue
        entered = enter(medium, own_wo, choice, u, v)
        inwards = to_world(out_of(frame, entered.direction), axis)
        if entered.weight <= ZERO or dot(inwards, hit.normal) >= ZERO:
            continue
        exit_ = exit_of(tracing, room, hit, medium, inwards, key, path)
        if exit_.found:
            weight = mul(channel_at(scene, closures.weight, k, hit.triangle, hit.u, hit.v), exit_.weight)
            weight = mul(weight, transmittance_to(scene, bsdf, k, wo))
            out = outside_of(scene, exit_)
            side = side_at(cache, out.triangle, out.u, out.v, out.back)
            total = plus(total, mul(weight, row(cache.arriving, side)))
    return total
