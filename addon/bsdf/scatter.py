"""What becomes of a ray where it meets a surface: one new direction, or of glass both, inside kernels."""

from typing import NamedTuple

import numpy as np

from ..core.compiling import part, routine
from ..core.vec3 import BLACK, ONE, ZERO, dot, mean, mul, negative, normalized, plus, times, to_local, to_world
from ..scene import RayKind
from ..scene.hit import channel_at, off_surface, shading_normal
from . import glass
from .closure import TRANSMITTING_LOBES, bsdf_at, closure_at, has_lobes, is_nothing, seen_from_behind
from .frames import UP, adjoint, bump_shadowing_in, frame_of, into, out_of, own_normal
from .mixture import (
    BROAD_LOBES,
    BUMPED_LOBES,
    DIFFUSE,
    FIBRE,
    GLASS,
    GLOSSY_LOBES,
    NARROW_LOBES,
    PANE,
    SUBSURFACE,
    TRANSLUCENT,
    choose_closure,
    is_cosine_lobe,
    sample_bsdf,
    transmittance_to,
)

_DIFFUSE_RAY, _GLOSSY_RAY, _TRANSMITTED_RAY = int(RayKind.DIFFUSE), int(RayKind.GLOSSY), int(RayKind.TRANSMITTED)
_COSINE_LOBES = 1 << DIFFUSE | 1 << TRANSLUCENT | 1 << SUBSURFACE
_REFLECTING = ~(1 << TRANSLUCENT | 1 << PANE | 1 << FIBRE)
_HALF, _TWO = np.float32(0.5), np.float32(2)
_FACING, _LEAST_COS = np.float32(1e-3), np.float32(1e-6)
_NOTHING = np.float32(1e-12)
_MAX_CORRECTION = np.float32(16)
"""Beyond it light grazes the facet, where very few photons meet it."""


class Scattered(NamedTuple):
    """Where a ray goes on.

    Attributes
    ----------
    alive : bool
        Whether anything is scattered; otherwise the weight is black.
    origin, direction : triples
        Off the surface, on the side that the direction leaves to.
    weight : triple
        What the surface leaves of the light, over the probability of going on like this.
    lobe : int32
        `Lobe` that scattered.
    kind : int32
        `RayKind` of the new ray.
    specular : bool
        Whether those who gather leave to photons what the lobe does to lamplight on this way.
    rough : bool
        Whether a glossy closure scattered that is no mirror.
    lamplight : float32
        What of the weight is left of light straight from sources of which points are sampled.
    """

    alive: bool
    origin: tuple
    direction: tuple
    weight: tuple
    lobe: np.int32
    kind: np.int32
    specular: bool
    rough: bool
    lamplight: np.float32


@part
def scatter(scene, hit, direction, choice, u, v, lobes, from_light, seen):
    """One new direction for a ray that met a surface, by what its material does.

    Of subsurface scattering it is the mirror image of the way into the body.

    Parameters
    ----------
    direction : triple
        Along which the ray flew.
    choice, u, v : float32 in [0, 1)
    lobes : int
        Those that may be chosen, as `ALL_LOBES`.
    from_light : bool
        Whether the ray is a photon; otherwise it comes from where light is wanted.
    seen : int
        `RayKind` of those who see the surface: of the ray itself, or of one that looks back along the photon's way on.
    """
    axis = axis_at(scene, hit, direction)
    bsdf, wo = bsdf_at(scene, hit, seen), to_local(negative(direction), axis)
    way, inverse = ZERO, ONE
    if from_light and scene.materials.two_faced[scene.material[hit.triangle]]:
        way, bsdf, choice, lobes, inverse = _way_of_photon(scene, bsdf, choice, lobes, seen)
    sample = sample_bsdf(scene, bsdf, wo, choice, u, v, lobes, from_light)
    weight, wi, lambertian = times(sample.weight, inverse), sample.wi, is_cosine_lobe(sample.lobe)
    if way * wi[2] < ZERO:
        weight = BLACK
    if bsdf.perturbed:
        weight = times(weight, _own_normal_correction(scene, bsdf, sample, wo, from_light))
    elif lambertian:
        axis = shading_normal(scene, hit)
        if from_light:
            weight = times(weight, shading_normal_correction(axis, hit.normal, direction))
            axis = hit.normal
    elif from_light and BROAD_LOBES >> sample.lobe & 1:  # by its cosine at the shading normal, and not the facet's
        left = abs(dot(to_world(wi, axis), hit.normal)) / max(wi[2], _LEAST_COS)
        correction = shading_normal_correction(axis, hit.normal, direction)
        weight = times(weight, correction * min(left, _MAX_CORRECTION))
    cos = wi[2] if from_light and lambertian else into(sample.frame, wi)[2]
    return _gone_on(scene, hit, axis, wi, cos, weight, sample.lobe, sample.specular, sample.rough, sample.lamplight)


@part
def _own_normal_correction(scene, bsdf, sample, wo, from_light):
    """What a sample's weight is multiplied by for its closure's own normal: what bumps shadow, and photons' cosines."""
    wi, frame, correction = sample.wi, sample.frame, ONE
    if sample.lobe == FIBRE or (sample.lobe == SUBSURFACE and not from_light):  # bodies' views have ways of their own
        return correction
    if (1 << DIFFUSE | 1 << SUBSURFACE | BUMPED_LOBES) >> sample.lobe & 1:
        correction = bump_shadowing_in(scene, bsdf, frame, wo if from_light else wi)
    if not from_light:
        return correction
    if is_cosine_lobe(sample.lobe):  # they leave by the cosine with the geometric normal already
        return correction * min(max(dot(wo, frame.axis), ZERO) / max(wo[2], _LEAST_COS), _MAX_CORRECTION)
    return correction * adjoint(wo, wi, into(frame, wo), into(frame, wi))


@part
def _way_of_photon(scene, bsdf, choice, lobes, seen):
    """Whether a photon goes back or through where the closures that send it back are not those that send it through.

    Returns
    -------
    way : float32
        1 back, −1 through.
    bsdf, choice, lobes
        The closures that are seen there, the choice fresh again, and the lobes that may send it there.
    inverse : float32
        1 over the chance of the way.
    """
    behind = seen_from_behind(scene, bsdf, seen)
    if not has_lobes(scene, behind, lobes & TRANSMITTING_LOBES):
        return ONE, bsdf, choice, lobes & _REFLECTING, ONE
    if choice < _HALF:
        return ONE, bsdf, _TWO * choice, lobes & _REFLECTING, _TWO
    return -ONE, behind, _TWO * choice - ONE, lobes & TRANSMITTING_LOBES, _TWO


@part
def scatter_both_ways(scene, hit, direction, choice, u, v, seen):
    """What glass reflects of a path from a view, and what it lets through: a `Scattered` each."""
    axis = axis_at(scene, hit, direction)
    bsdf, wo = bsdf_at(scene, hit, seen), to_local(negative(direction), axis)
    chosen, inverse, _ = choose_closure(scene, bsdf, wo, choice, 1 << GLASS, False)
    if chosen < 0:
        nothing = _gone_on(scene, hit, axis, UP, ONE, BLACK, np.int32(GLASS), True, False, ONE)
        return nothing, nothing
    closure, frame = closure_at(scene, bsdf, chosen), frame_of(scene, bsdf, chosen, wo)
    own_wo = into(frame, wo)
    facet = glass.facet_of(closure, own_wo, u, v)
    up, reflected = glass.scatter(closure, own_wo, facet, True, False)
    down, refracted = glass.scatter(closure, own_wo, facet, False, False)
    factor = times(transmittance_to(scene, bsdf, chosen, wo), inverse)
    reflected, refracted = mul(reflected, factor), mul(refracted, factor)
    return (
        _gone_on(scene, hit, axis, out_of(frame, up), up[2], reflected, np.int32(GLASS), True, False, ONE),
        _gone_on(scene, hit, axis, out_of(frame, down), down[2], refracted, np.int32(GLASS), True, False, ONE),
    )


@part
def _gone_on(scene, hit, axis, wi, cos, weight, lobe, specular, rough, lamplight):
    """A local direction around an axis in the world, at a cosine to its closure's normal.

    None where that sends it to the wrong side of the facet.
    """
    onward = to_world(wi, axis)
    side = ONE if dot(onward, hit.normal) > ZERO else -ONE
    alive = (side * cos > ZERO or lobe == FIBRE) and not is_nothing(weight)
    if not alive:
        weight = BLACK
    kind = _DIFFUSE_RAY
    if GLOSSY_LOBES >> lobe & 1:
        kind = _GLOSSY_RAY
    elif NARROW_LOBES >> lobe & 1:
        kind = _GLOSSY_RAY if side > ZERO else _TRANSMITTED_RAY  # what glass reflects, objects see as gloss
    origin = off_surface(scene, hit, side)
    return Scattered(alive, origin, onward, weight, lobe, np.int32(kind), specular, rough, lamplight)


@part
def axis_at(scene, hit, direction):
    """What +z of the local frame is where a ray meets a surface: of materials without normals of their own `facing`."""
    if scene.materials.perturbed[scene.material[hit.triangle]]:
        return hit.normal
    return facing(shading_normal(scene, hit), hit.normal, direction)


@part
def lit_normal(scene, hit):
    """The normal on which the light is measured that Lambertian closures take (`weight_received`)."""
    if scene.materials.perturbed[scene.material[hit.triangle]]:
        return hit.normal
    return shading_normal(scene, hit)


@part
def lambertian_normal(scene, hit):
    """The mean of the normals of a point's Lambertian and broad closures by their weights, a unit vector."""
    return mean_normal(scene, hit, _DIFFUSE_RAY, _COSINE_LOBES | BROAD_LOBES, hit.normal)


@part
def mean_normal(scene, hit, kind, lobes, view):
    """The same of the closures of some lobes, as rays of a `RayKind` see them from a direction of the world."""
    shading = shading_normal(scene, hit)
    if not scene.materials.perturbed[scene.material[hit.triangle]]:
        return shading
    return _mean_own_normal(scene, hit, bsdf_at(scene, hit, kind), shading, lobes, view)


@routine
def _mean_own_normal(scene, hit, bsdf, shading, lobes, view):
    """`mean_normal` where closures have normals of their own."""
    total, closures = BLACK, scene.materials.closures
    for k in range(bsdf.first, bsdf.last):
        if lobes >> closures.kind[k] & 1:
            weight = mean(channel_at(scene, closures.weight, k, hit.triangle, hit.u, hit.v))
            total = plus(total, times(own_normal(scene, bsdf, k, view), weight))
    return normalized(total) if dot(total, total) > _NOTHING else shading


@part
def facing(shading, normal, direction):
    """The shading normal, or the geometric one where that does not face the ray: no lobe is seen from behind."""
    return shading if dot(shading, direction) < -_FACING else normal


@part
def shading_normal_correction(shading, normal, direction):
    """What the power of a photon is multiplied by where a smooth surface scatters it broadly, (N·ω)⁺ / |n·ω|.

    Photons arrive in proportion to the cosine at the geometric normal n, but light is reflected in proportion to that
    at the shading normal N (Veach 1997, 5.3.2).
    """
    cosine = max(abs(dot(normal, direction)), _LEAST_COS)
    return min(max(-dot(shading, direction), ZERO) / cosine, _MAX_CORRECTION)
