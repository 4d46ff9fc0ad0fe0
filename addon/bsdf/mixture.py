"""The sum of a point's closures: sampled, evaluated and weighed against each other, inside kernels.

A lobe's own file has its formulas. The functions here say which file a kind of closure means: `albedo_of`, `_sample`,
`_evaluate_closure`, `_pdf`, `_is_specular` and `_is_rough`.
"""

from typing import NamedTuple

import numpy as np

from ..core.compiling import part, routine
from ..core.vec3 import BLACK, ONE, WHITE, ZERO, largest, mean, mul, negative, plus, times
from ..scene.closures import BROAD, DIRECTED, GLOSSY_KINDS, LAMBERTIAN, NARROW, Lobe
from . import glass, glossy
from .broad import lobes as broad
from .broad import toon
from .closure import Bsdf, angle_weight, bsdf_at, closure_at, is_nothing
from .fibres import fibre
from .frames import THE_POINTS, UP, Frame, bump_shadowing_in, frame_of, into, out_of
from .lambertian import diffuse, translucent

DIFFUSE, TRANSLUCENT, GLOSSY, GLASS = (int(lobe) for lobe in list(Lobe)[:4])
GLOSSY_TOON, PANE, FIBRE = int(Lobe.GLOSSY_TOON), int(Lobe.PANE), int(Lobe.FIBRE)
SUBSURFACE = int(Lobe.SUBSURFACE)

ALL_LOBES = (1 << len(Lobe)) - 1
NARROW_LOBES, BROAD_LOBES, DIRECTED_LOBES, GLOSSY_LOBES, _LAMBERTIAN_LOBES = (
    sum(1 << lobe for lobe in lobes) for lobes in (NARROW, BROAD, DIRECTED, GLOSSY_KINDS, LAMBERTIAN)
)
"""Sets of lobes as bits; see `scene.closures`."""
BUMPED_LOBES = BROAD_LOBES & ~(1 << int(Lobe.VELVET))
"""Broad lobes that Cycles shadows where bumps turn from the light."""

_TINY, _LEAST_COS = np.float32(1e-7), np.float32(1e-6)
_BELOW_ONE, _INFINITY = np.float32(1 - 2**-24), np.float32(np.inf)
_N_KINDS, _GRAZING = len(Lobe), np.float32(0.2)

__all__ = ["ALL_LOBES", "BROAD_LOBES", "DIRECTED_LOBES", "NARROW_LOBES", "Bsdf", "Sample", "bsdf_at", "sample_bsdf"]


class Sample(NamedTuple):
    """A scattered direction.

    weight : f |cos wi| / (density of wi · probability of its closure); 0 where nothing is scattered.
    lobe : kind of the closure that scattered.
    specular : whether lamplight that takes this way is left to photons: all of it through glass and in mirrors, and the
        peaks of rough gloss. `evaluate_glossy_below_peak` has the rest.
    rough : whether a glossy closure scattered that is no mirror, one of those that `pdf_glossy` is of.
    frame : of the closure that scattered.
    lamplight : share of the weight that is left of light from sources of which points are sampled.
    """

    wi: tuple
    weight: tuple
    lobe: np.int32
    specular: bool
    rough: bool
    frame: Frame
    lamplight: np.float32


@part
def sample_bsdf(scene, bsdf, wo, choice, u, v, lobes, from_light):
    """One direction, of one closure, chosen by what each scatters of light from wo.

    wo is where the light came from, or with `from_light` false the viewing side; the three numbers are in [0, 1).
    `lobes` are those that may be chosen.
    """
    chosen, inverse, choice = choose_closure(scene, bsdf, wo, choice, lobes, from_light)
    if chosen < 0:
        return Sample(UP, BLACK, np.int32(_first_of(lobes)), False, False, THE_POINTS, ONE)
    closure, frame = closure_at(scene, bsdf, chosen), frame_of(scene, bsdf, chosen, wo)
    own_wo = into(frame, wo)
    own_wi, weight = _sample(closure, own_wo, choice, u, v, from_light)
    wi = out_of(frame, own_wi)
    if from_light and is_cosine_lobe(closure.kind):  # photons' is with the geometric normal, see `scatter`
        wi = own_wi
        if bsdf.perturbed and closure.kind in (TRANSLUCENT, SUBSURFACE):
            frame = frame_of(scene, bsdf, chosen, negative(wi) if closure.kind == TRANSLUCENT else wi)
    view, light = (own_wi, own_wo) if from_light else (own_wo, own_wi)
    weight = times(mul(weight, transmittance_to(scene, bsdf, chosen, wi if from_light else wo)), inverse)
    lamplight = fibre.lamplight_share(closure, view, light) if closure.kind == FIBRE else ONE
    return Sample(wi, weight, closure.kind, _is_specular(closure, view, light), _is_rough(closure), frame, lamplight)


@part
def is_cosine_lobe(kind):
    """Whether a closure's directions are by the cosine: of a Lambertian one, and of light that enters a body."""
    return kind < GLOSSY or kind == SUBSURFACE


@part
def choose_closure(scene, bsdf, wo, choice, lobes, from_light):
    """A closure by what each scatters: which, −1 for none; 1 over its probability; and the choice, fresh again."""
    if bsdf.last - bsdf.first == 1 and (lobes & _LAMBERTIAN_LOBES) >> scene.materials.closures.kind[bsdf.first] & 1:
        return bsdf.first, ONE, choice
    total, share, chosen = ZERO, ONE, np.int32(-1)
    for k in range(bsdf.first, bsdf.last):  # one after the other takes its share of the choice
        if not lobes >> scene.materials.closures.kind[k] & 1:
            continue
        scattered = _expected(scene, bsdf, k, wo, from_light)
        if scattered <= ZERO:
            continue
        total += scattered
        bound = scattered / total
        if choice < bound:
            share, chosen, choice = scattered, np.int32(k), choice / bound
        else:
            choice = (choice - bound) / max(ONE - bound, _TINY)
        choice = min(choice, _BELOW_ONE)
    return chosen, total / share, choice


@part
def _first_of(lobes):
    """The first of a set of lobes."""
    for kind in range(_N_KINDS):
        if lobes >> kind & 1:
            return kind
    return 0


@part
def _expected(scene, bsdf, k, wo, from_light):
    """What the k-th closure scatters of light from a direction, about; above 0 wherever it scatters any."""
    closure = closure_at(scene, bsdf, k)
    if is_nothing(closure.weight):
        return ZERO
    cos = ONE
    if closure.kind >= GLOSSY and closure.kind != FIBRE:
        cos = into(frame_of(scene, bsdf, k, wo), wo)[2]
        if cos <= ZERO:  # a lobe that is seen from behind
            return ZERO
    # What layers leave of a photon is not known before its direction is
    left = ONE if from_light else mean(transmittance_to(scene, bsdf, k, wo))
    if closure.kind == GLASS:
        return glass.albedo(closure, cos, from_light) * left
    # A photon views from elsewhere, and sheen is seen where it grazes
    return mean(albedo_of(closure, min(cos, _GRAZING) if from_light and closure.kind > GLASS else cos)) * left


@part
def albedo_of(closure, cos):
    """Directional albedo of a closure that is not glass."""
    if is_cosine_lobe(closure.kind) or closure.kind == FIBRE:
        return closure.weight
    return glossy.albedo(closure, cos) if closure.kind in (GLOSSY, PANE) else broad.albedo(closure, cos)


@part
def _sample(closure, wo, choice, u, v, from_light):
    """A direction of one closure and its weight."""
    if closure.kind in (DIFFUSE, SUBSURFACE):  # mirrored, the way into the body
        return diffuse.sample(closure, u, v)
    if closure.kind == TRANSLUCENT:
        return translucent.sample(closure, u, v)
    if closure.kind in (GLOSSY, PANE):
        wi, weight = glossy.sample(closure, wo, u, v, from_light)
        return ((wi[0], wi[1], -wi[2]) if closure.kind == PANE else wi), weight
    if closure.kind == GLASS:
        return glass.sample(closure, wo, choice, u, v, from_light)
    if closure.kind == FIBRE:
        return fibre.sample(closure, wo, choice, u, v, from_light)
    return broad.sample(closure, wo, u, v, from_light)


@part
def _evaluate_closure(closure, view, light):
    """The f of one broad or glossy closure in 1/sr, without the cosine."""
    return glossy.evaluate(closure, view, light) if closure.kind == GLOSSY else broad.evaluate(closure, view, light)


@part
def _pdf(closure, view, light):
    """Density of `light` by solid angle when one glossy closure is sampled from `view`."""
    return glossy.pdf(closure, view, light) if closure.kind == GLOSSY else toon.pdf(closure, view, light)


@part
def _is_specular(closure, view, light):
    """Whether lamplight from `light` to `view` is left to photons: by glass, panes, fibres, and by peaks of gloss."""
    if closure.kind == GLOSSY:
        return glossy.is_specular(closure, view, light)
    if closure.kind == GLOSSY_TOON:
        return largest(broad.evaluate(closure, view, light)) >= glossy.PEAK
    return closure.kind in (GLASS, PANE, FIBRE)


@part
def _is_rough(closure):
    """Whether it is a glossy closure that is no mirror."""
    return closure.kind == GLOSSY_TOON or (closure.kind == GLOSSY and closure.roughness >= glossy.SMOOTH)


@part
def transmittance_to(scene, bsdf, k, view):
    """Share of light that the k-th closure's layers and curve leave to it, seen from a direction on either side."""
    left, layer = times(WHITE, angle_weight(scene, k, abs(view[2]))), scene.materials.closures.layer[k]
    while layer >= 0:
        over, cos = closure_at(scene, bsdf, layer), abs(into(frame_of(scene, bsdf, layer, view), view)[2])
        if over.kind == GLOSSY:
            left = times(left, glossy.transmittance(over, cos))
        else:
            left = mul(left, broad.transmittance(over, cos))
        layer = over.layer
    return left


@part
def evaluate_direct(scene, bsdf, wo, wi):
    """What shadow rays ask for of broad and glossy lobes: f in 1/sr without the cosine, less the peaks of gloss.

    Photons bring the light of those. The cosine is that with +z: f of a lobe with a frame of its own is times its
    cosine over that.
    """
    return _evaluate(scene, bsdf, wo, wi, GLOSSY_LOBES | BROAD_LOBES, glossy.PEAK)


@part
def evaluate_glossy_below_peak(scene, bsdf, wo, wi):
    """The part of `evaluate_glossy` that shadow rays ask for, `evaluate_direct` of glossy lobes alone."""
    return _evaluate(scene, bsdf, wo, wi, GLOSSY_LOBES, glossy.PEAK)


@part
def evaluate_glossy(scene, bsdf, wo, wi):
    """The f of all rough glossy lobes in 1/sr, without the cosine; wo is the viewing side."""
    return _evaluate(scene, bsdf, wo, wi, GLOSSY_LOBES, _INFINITY)


@routine
def _evaluate(scene, bsdf, wo, wi, lobes, peak):
    """The f of a set of broad and glossy lobes; of a glossy one 0 where it is not below `peak`, 1/sr."""
    f = BLACK
    for k in range(bsdf.first, bsdf.last):
        kind = scene.materials.closures.kind[k]
        if lobes >> kind & 1:
            closure, frame = closure_at(scene, bsdf, k), frame_of(scene, bsdf, k, wo)
            own_wo, own_wi = into(frame, wo), into(frame, wi)
            of_one = _evaluate_closure(closure, own_wo, own_wi)
            if BROAD_LOBES >> kind & 1 or largest(of_one) < peak:
                of_one = mul(of_one, transmittance_to(scene, bsdf, k, wo))
                if frame.own:
                    share = max(own_wi[2], ZERO) / max(wi[2], _LEAST_COS)
                    if BUMPED_LOBES >> kind & 1:
                        share *= bump_shadowing_in(scene, bsdf, frame, wi)
                    of_one = times(of_one, share)
                f = plus(f, of_one)
    return f


@routine
def pdf_glossy(scene, bsdf, wo, wi):
    """Density of wi by solid angle when a path's rough glossy lobes are sampled from wo."""
    total = density = ZERO
    for k in range(bsdf.first, bsdf.last):
        if GLOSSY_LOBES >> scene.materials.closures.kind[k] & 1:
            closure = closure_at(scene, bsdf, k)
            if _is_rough(closure):
                share, frame = _expected(scene, bsdf, k, wo, False), frame_of(scene, bsdf, k, wo)
                view, light = into(frame, wo), into(frame, wi)
                total += share
                density += share * _pdf(closure, view, light)
    return density / total if total > ZERO else ZERO
