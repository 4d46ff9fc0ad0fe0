"""Forced scattering: where media scatter a ray if they do so before its end, whatever else might become of it."""

from typing import NamedTuple

import numpy as np

from ...core.compiling import part, routine
from ...core.vec3 import BLACK, ONE, ZERO, mean, mul, plus, row, times
from ..embree import INFINITY
from .flight import faded, passed

_TINY, _BELOW_ONE = np.float32(1e-30), np.float32(1 - 2**-24)


class Scattering(NamedTuple):
    """Where media scatter a ray.

    Attributes
    ----------
    volume : int
        That which does; −1 where none can.
    distance : float32, m
    weight : triple
        What they leave of light on the way from there, times σs, over the probability density.
    """

    volume: np.int64
    distance: np.float32
    weight: tuple


@routine
def forced_scattering(tracing, room, origin, direction, far, place, choice):
    """Where media scatter a ray before `far`, by two numbers in [0, 1).

    The distance has the density Σ σt e^(−∫σt) over volumes that scatter and their channels, over its integral: with
    one volume and no color it is in proportion to the light that comes from there, and the weight is the albedo times
    what does not pass, 1 − T. The first number rises along the ray.
    """
    media, total = tracing.media, ZERO
    for k in range(len(media.tree)):
        if media.scatters[k]:
            mass, _, _ = passed(tracing, room, k, origin, direction, far, INFINITY)
            total += _stopped(media, k, 0, mass) + _stopped(media, k, 1, mass) + _stopped(media, k, 2, mass)
    left, distance = place * total, INFINITY
    for k in range(len(media.tree)):
        if not media.scatters[k] or left < ZERO:
            continue
        mass, _, _ = passed(tracing, room, k, origin, direction, far, INFINITY)
        stopped = _stopped(media, k, 0, mass) + _stopped(media, k, 1, mass) + _stopped(media, k, 2, mass)
        if left < stopped:
            channel, choice = _channel(media, k, mass, choice * stopped)
            most = -np.log1p(-left / stopped * _stopped(media, k, channel, mass)) / _extinction(media, k, channel)
            _, distance, _ = passed(tracing, room, k, origin, direction, far, most)
        left -= stopped
    if distance >= far:
        return Scattering(np.int64(-1), far, BLACK)
    return _at(tracing, room, origin, direction, distance, total, choice)


@part
def _channel(media, k, mass, choice):
    """A channel of a volume by how much it stops of each, and what is left of the number, in [0, 1)."""
    for channel in range(2):
        stopped = _stopped(media, k, channel, mass)
        if choice < stopped:
            return channel, choice / stopped
        choice -= stopped
    return 2, min(choice / max(_stopped(media, k, 2, mass), _TINY), _BELOW_ONE)


@routine
def _at(tracing, room, origin, direction, distance, total, choice):
    """The scattering at a distance, by a volume in proportion to what each scatters there."""
    media, density, depth, scattered = tracing.media, ZERO, BLACK, ZERO
    volume, own = np.int64(-1), BLACK
    for k in range(len(media.tree)):
        mass, _, there = passed(tracing, room, k, origin, direction, distance, INFINITY)
        for channel in range(3):
            if media.scatters[k]:
                density += there * _extinction(media, k, channel) * (ONE - _stopped(media, k, channel, mass))
        extinction = _extinction(media, k, 0), _extinction(media, k, 1), _extinction(media, k, 2)
        depth = plus(depth, times(extinction, mass))
        here = mean(row(media.scattering, k)) * there
        scattered += here
        # Each takes the place of those before it as often as its part of the sum is
        if here > choice * scattered:
            volume, own, choice = np.int64(k), times(row(media.scattering, k), there / here), choice * scattered / here
        elif scattered > ZERO:
            choice = (choice * scattered - here) / (scattered - here)
    if volume < 0 or density <= ZERO:
        return Scattering(np.int64(-1), distance, BLACK)
    return Scattering(volume, distance, mul(faded(depth), times(own, scattered * total / density)))


@part
def _extinction(media, k, channel):
    """σt of a volume where its density is 1."""
    return media.absorption[k, channel] + media.scattering[k, channel]


@part
def _stopped(media, k, channel, mass):
    """The share of light that a volume stops of what is to pass a mass of it."""
    extinction = _extinction(media, k, channel)
    return -np.expm1(-extinction * mass) if extinction > ZERO else ZERO
