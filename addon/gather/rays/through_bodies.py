"""What a gather ray sees of the light that walked through a body: a walk from where it ends (see `bsdf.subsurface`)."""

from ...bsdf.mixture import SUBSURFACE, transmittance_to
from ...bsdf.scatter import axis_at
from ...core.compiling import routine
from ...core.sampling.path_numbers import two_numbers
from ...core.vec3 import BLACK, mul, negative, plus, row, to_local
from ...scene.hit import channel_at
from ...tracing.bodies.through import outside_of, seen_walk
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
        exit_ = seen_walk(tracing, room, hit, bsdf, k, axis, wo, choice, u, v, key, path)
        if exit_.found:
            weight = mul(channel_at(scene, closures.weight, k, hit.triangle, hit.u, hit.v), exit_.weight)
            weight = mul(weight, transmittance_to(scene, bsdf, k, wo))
            out = outside_of(scene, exit_)
            side = side_at(cache, out.triangle, out.u, out.v, out.back)
            total = plus(total, mul(weight, row(cache.arriving, side)))
    return total
