"""What the closures of a point weigh, and scatter in all of what comes from everywhere, inside kernels."""

from ..core.compiling import part, routine
from ..core.vec3 import BLACK, ONE, ZERO, mean, mul, plus, times, to_local
from ..scene.closures import Lobe
from ..scene.hit import channel_at, weight_of_kind
from . import glossy
from .closure import closure_at, roughness_at
from .frames import frame_of, into, received
from .mixture import (
    BROAD_LOBES,
    DIFFUSE,
    FIBRE,
    GLASS,
    GLOSSY,
    GLOSSY_LOBES,
    GLOSSY_TOON,
    PANE,
    SUBSURFACE,
    TRANSLUCENT,
    albedo_of,
    transmittance_to,
)

_DIFFUSE_LOBES = 1 << DIFFUSE | 1 << SUBSURFACE | BROAD_LOBES
_ABSORBING = int(Lobe.ABSORBING)


@part
def total_weight(scene, bsdf, kind):
    """Sum of the weights of closures of one kind: albedo or transmission, before what layers take."""
    return weight_of_kind(scene, kind, bsdf.first, bsdf.last, bsdf.triangle, bsdf.u, bsdf.v)


@routine
def weight_received(scene, bsdf, kind, towards):
    """`total_weight` of Lambertian closures, each times what it takes of light from a direction (`received`).

    The light is that on `lit_normal`, its direction one of the world.
    """
    if not bsdf.perturbed:
        return total_weight(scene, bsdf, kind)
    total, closures, light = BLACK, scene.materials.closures, to_local(towards, bsdf.normal)
    for k in range(bsdf.first, bsdf.last):
        if closures.kind[k] == kind:
            weight = channel_at(scene, closures.weight, k, bsdf.triangle, bsdf.u, bsdf.v)
            total = plus(total, times(weight, received(scene, bsdf, k, light)))
    return total


@routine
def received_by_body(scene, bsdf, towards):
    """What subsurface closures take of light from a direction of the world: the mean of `received` by their weights."""
    if not bsdf.perturbed:
        return ONE
    total, whole, closures, light = ZERO, ZERO, scene.materials.closures, to_local(towards, bsdf.normal)
    for k in range(bsdf.first, bsdf.last):
        if closures.kind[k] == SUBSURFACE:
            weight = mean(channel_at(scene, closures.weight, k, bsdf.triangle, bsdf.u, bsdf.v))
            total, whole = total + weight * received(scene, bsdf, k, light), whole + weight
    return total / whole if whole > ZERO else ONE


@routine
def _albedo(scene, bsdf, lobes, wo):
    """What some lobes but glass scatter in all of light seen from a local direction, with what layers leave of it."""
    total = BLACK
    for k in range(bsdf.first, bsdf.last):
        if lobes >> scene.materials.closures.kind[k] & 1:
            closure, cos = closure_at(scene, bsdf, k), ONE
            if closure.kind >= GLOSSY:
                cos = max(into(frame_of(scene, bsdf, k, wo), wo)[2], ZERO)
            total = plus(total, mul(albedo_of(closure, cos), transmittance_to(scene, bsdf, k, wo)))
    return total


@part
def diffuse_albedo(scene, bsdf, wo):
    """What Lambertian and broad lobes reflect in all, seen from a local direction, with what layers leave of it."""
    return _albedo(scene, bsdf, _DIFFUSE_LOBES, wo)


@part
def broad_albedo(scene, bsdf, wo, lobes):
    """What some broad lobes reflect that are not Lambertian."""
    return _albedo(scene, bsdf, lobes & BROAD_LOBES, wo)


@part
def translucent_albedo(scene, bsdf, wo):
    """What a surface seen from a local direction transmits diffusely, with what layers leave of it."""
    return _albedo(scene, bsdf, 1 << TRANSLUCENT, wo)


@part
def glossy_albedo(scene, bsdf, wo):
    """What the glossy lobes of a surface seen from a local direction reflect in all."""
    return _albedo(scene, bsdf, GLOSSY_LOBES, wo)


@routine
def glass_albedo(scene, bsdf):
    """What glass reflects or transmits of a colour, whichever is more, and what fibres scatter at most."""
    total = BLACK
    for k in range(bsdf.first, bsdf.last):
        if scene.materials.closures.kind[k] in (GLASS, PANE):
            closure = closure_at(scene, bsdf, k)
            more = (
                max(closure.f0[0], closure.f90[0]),
                max(closure.f0[1], closure.f90[1]),
                max(closure.f0[2], closure.f90[2]),
            )
            total = plus(total, mul(closure.weight, more))
        elif scene.materials.closures.kind[k] == FIBRE:
            total = plus(total, closure_at(scene, bsdf, k).weight)
    return total


@routine
def base_transmittance(scene, bsdf, wo):
    """Share of what the Lambertian lobes would scatter that layers leave to them, seen from wo; 1 without any."""
    last, n = -1, 0
    for k in range(bsdf.first, bsdf.last):
        if scene.materials.closures.kind[k] < GLOSSY:
            last, n = k, n + 1
    if n == 1:  # whatever its weight, which may ask a texture
        return transmittance_to(scene, bsdf, last, wo)
    whole = left = BLACK
    for k in range(bsdf.first, bsdf.last):
        if scene.materials.closures.kind[k] < GLOSSY:
            weight = channel_at(scene, scene.materials.closures.weight, k, bsdf.triangle, bsdf.u, bsdf.v)
            whole, left = plus(whole, weight), plus(left, mul(weight, transmittance_to(scene, bsdf, k, wo)))
    return _ratio(left[0], whole[0]), _ratio(left[1], whole[1]), _ratio(left[2], whole[2])


@part
def _ratio(a, b):
    return a / b if b > ZERO else ONE


@part
def reflects_highlights(scene, bsdf):
    """Whether a glossy lobe is rough enough for shadow rays to find light by it."""
    for k in range(bsdf.first, bsdf.last):
        kind = scene.materials.closures.kind[k]
        if kind == GLOSSY_TOON or (kind == GLOSSY and roughness_at(scene, bsdf, k)[0] >= glossy.SMOOTH):
            return True
    return False


@part
def is_mirror(scene, bsdf):
    """Whether light is scattered by smooth gloss or glass alone."""
    n = 0
    for k in range(bsdf.first, bsdf.last):
        kind = scene.materials.closures.kind[k]
        if kind == _ABSORBING:
            continue
        if kind not in (GLOSSY, GLASS, PANE) or roughness_at(scene, bsdf, k)[0] >= glossy.SMOOTH:
            return False
        n += 1
    return n > 0
