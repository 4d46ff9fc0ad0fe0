"""Rays through media: how far they fly in each, what is left of their light, and where a medium scatters them."""

from typing import NamedTuple

import numpy as np

from ...core.compiling import part, routine
from ...core.vec3 import BLACK, ONE, ZERO, along, mean, mul, plus, row, times
from ...scene.hit import is_back
from ..embree import INFINITY, intersect_beyond
from ..ray_hash import hashed
from .density import density_at, mass_between
from .scattering import phase_density

_MAX_CROSSINGS = 64  # of one volume's surface along a ray
_BEYOND = np.float32(1 + 2**-19)
"""Over the distance of a crossing, that of the nearest one that counts beside it: edges are met with both faces."""

_ROUNDING = np.float32(2**-21)
_CHANNEL, _FIRST_VOLUME = 1 << 10, (1 << 10) + 1  # steps of a ray's own numbers, beside those of surfaces
_TINY = np.float32(1e-30)


class Flight(NamedTuple):
    """How far a ray comes through media.

    Attributes
    ----------
    volume : int
        That which scatters it; −1 where it comes to its end.
    distance : float32, m
        Where.
    weight : triple
        What is left of its light, over the probability density: of a scattering times σs.
    """

    volume: np.int64
    distance: np.float32
    weight: tuple


@routine
def fly(tracing, room, origin, direction, far):
    """How far a ray comes on its way to `far`.

    Each volume that scatters draws where it would do so, by the extinction of one channel, the same in all; the first
    one does. Weights are by the balance heuristic over channels. What but absorbs takes its share.
    """
    media, volume, reach = tracing.media, np.int64(-1), np.float32(far)
    channel = min(np.int64(np.float32(3) * hashed(origin, direction, _CHANNEL)), 2)
    for k in range(len(media.tree)):
        extinction = media.absorption[k, channel] + media.scattering[k, channel]
        if not media.scatters[k] or extinction <= ZERO:
            continue
        most = -np.log(ONE - hashed(origin, direction, _FIRST_VOLUME + k)) / extinction
        _, at, _ = passed(tracing, room, k, origin, direction, reach, most)
        if at < reach:
            volume, reach = np.int64(k), at
    scattering, absorbing = _depths(tracing, room, origin, direction, reach)
    left, weight = faded(scattering), faded(absorbing)
    if volume < 0:
        return Flight(volume, reach, mul(weight, times(left, ONE / max(mean(left), _TINY))))
    own = row(media.scattering, volume)
    density = mean(mul(plus(own, row(media.absorption, volume)), left))
    return Flight(volume, reach, mul(weight, times(mul(own, left), ONE / max(density, _TINY))))


@routine
def media_left(tracing, room, origin, direction, far):
    """What media leave of the light on a straight way, exp(−∫σt)."""
    scattering, absorbing = _depths(tracing, room, origin, direction, far)
    return faded(plus(scattering, absorbing))


@part
def faded(depth):
    """What is left of light behind an optical depth."""
    return np.exp(-depth[0]), np.exp(-depth[1]), np.exp(-depth[2])


@routine
def _depths(tracing, room, origin, direction, far):
    """Optical depths of media that scatter, and of those that but absorb, as far as `far`."""
    media, scattering, absorbing = tracing.media, BLACK, BLACK
    for k in range(len(media.tree)):
        mass, _, _ = passed(tracing, room, k, origin, direction, far, INFINITY)
        if mass <= ZERO:
            continue
        depth = _depth(plus(row(media.absorption, k), row(media.scattering, k)), mass)
        if media.scatters[k]:
            scattering = plus(scattering, depth)
        else:
            absorbing = plus(absorbing, depth)
    return scattering, absorbing


@routine
def scattering_at(tracing, room, origin, direction, distance, cos):
    """Light that media scatter onto a ray at a distance, and leave of it on the ray, over what comes there, 1/(m sr).

    T Σ σs p(cos θ), where `cos` is between the ray and the way to where the light comes from.
    """
    media, total, depth = tracing.media, BLACK, BLACK
    for k in range(len(media.tree)):
        mass, _, density = passed(tracing, room, k, origin, direction, distance, INFINITY)
        depth = plus(depth, _depth(plus(row(media.absorption, k), row(media.scattering, k)), mass))
        if density > ZERO:
            total = plus(total, times(row(media.scattering, k), density * phase_density(media, k, cos)))
    return mul(total, faded(depth))


@part
def span_of_media(media, origin, direction, far):
    """Between which distances a ray may be inside of media before `far`; the first is not below the second if none."""
    start, end = far, ZERO
    for k in range(len(media.tree)):
        enters, leaves = box_span(row(media.low, k), row(media.high, k), origin, direction, far)
        if enters < leaves:
            start, end = min(start, enters), max(end, leaves)
    return start, end


@part
def _depth(extinction, mass):
    """σt times a mass that may be infinite."""
    r = extinction[0] * mass if extinction[0] > ZERO else ZERO
    g = extinction[1] * mass if extinction[1] > ZERO else ZERO
    b = extinction[2] * mass if extinction[2] > ZERO else ZERO
    return r, g, b


@routine
def passed(tracing, room, k, origin, direction, far, most):
    """What a ray passes of the k-th volume before `far`: lengths inside of it by its density.

    Returns
    -------
    mass : float32, m
    distance : float32, m
        At which the mass is `most`; infinite where it is below.
    density : float32
        That of the volume at `far`; zero outside.
    """
    media, tree = tracing.media, tracing.media.tree[k]
    if tree == 0:
        mass, at = mass_between(media, k, origin, direction, ZERO, far, most)
        return mass, at, density_at(media, k, along(origin, far, direction))
    mass, since, near, inside = ZERO, ZERO, ZERO, False
    low, high = row(media.low, k), row(media.high, k)
    enters, exits = box_span(low, high, origin, direction, far)
    if enters > exits:
        return ZERO, INFINITY, ZERO
    # Rays that meet an edge of the outline meet one of its faces: what starts or ends nowhere is not counted
    may_start_inside = _is_in_box(low, high, origin)
    least = _ROUNDING * (abs(origin[0]) + abs(origin[1]) + abs(origin[2])) + _TINY  # of what starts on a face
    for crossing in range(_MAX_CROSSINGS):
        triangle, distance, _, _ = intersect_beyond(tree, room, origin, direction, near, INFINITY)
        if triangle < 0:
            break
        leaves = is_back(tracing.scene, media.triangle[media.first[k] + triangle], direction)
        if leaves and (inside or (crossing == 0 and may_start_inside)):
            added, at = mass_between(media, k, origin, direction, since, min(distance, far), most - mass)
            mass, inside = mass + added, False
            if at < INFINITY:
                return most, at, ZERO
            if distance >= far:
                return mass, INFINITY, density_at(media, k, along(origin, far, direction)) if since < far else ZERO
        elif not leaves and not inside:
            inside, since = True, distance
        if distance >= far:
            break
        near = distance * _BEYOND + least
    return mass, INFINITY, ZERO


@part
def box_span(low, high, origin, direction, far):
    """Between which distances a ray is in a box before `far`; the first is above the second where it is not."""
    start, end = ZERO, far
    for i in range(3):
        if direction[i] == ZERO:
            if origin[i] < low[i] or origin[i] > high[i]:
                return far, -ONE
            continue
        a, b = (low[i] - origin[i]) / direction[i], (high[i] - origin[i]) / direction[i]
        start, end = max(start, min(a, b)), min(end, max(a, b))
    return start, end


@part
def _is_in_box(low, high, x):
    """Whether a point is inside of a box, or on it."""
    return low[0] <= x[0] <= high[0] and low[1] <= x[1] <= high[1] and low[2] <= x[2] <= high[2]
