"""Where on a ray in media the light of a lamp is asked for.

What comes from a lamp has a peak where the ray passes it, 1/d²; by the angle θ at which the lamp sees the ray, from
where that is nearest, it has none (Kulla and Fajardo 2012). What is scattered along the ray is in proportion to the
phase function of the angle there, whose cosine is −sin θ: θ is drawn by that, linear between some angles.
"""

import numpy as np

from ...core.compiling import part, routine
from ...core.vec3 import ONE, TWO, ZERO, dot, length, mean, minus, row, times
from ...scene import LightKind
from ...tracing.media.flight import box_span
from ...tracing.media.scattering import phase_density

_SUN = int(LightKind.SUN)
_N_INTERVALS = 16
_LEAST_GAP = np.float32(1e-6)  # of a lamp beside a ray, m, and over its distance
_HALF = np.float32(0.5)


@routine
def place_on_ray(media, lamps, lamp, origin, direction, start, end, number):
    """A distance along a ray between two by a number in [0, 1), and its density, 1/m."""
    if lamps.kind[lamp] == _SUN:
        return start + number * (end - start), ONE / (end - start)
    to_lamp = minus(row(lamps.position, lamp), origin)
    nearest = dot(to_lamp, direction)
    gap = max(length(minus(to_lamp, times(direction, nearest))), _LEAST_GAP * (ONE + length(to_lamp)))
    first, last = np.arctan((start - nearest) / gap), np.arctan((end - nearest) / gap)
    angle, density = _angle(media, _main_volume(media, origin, direction, end), first, last, number)
    offset = gap * np.tan(angle)
    distance = min(max(nearest + offset, start), end)
    return distance, density * gap / (gap * gap + offset * offset)


@part
def _main_volume(media, origin, direction, far):
    """Of the volumes whose boxes a ray meets, that which scatters most."""
    most, found = -ONE, 0
    for k in range(len(media.tree)):
        scatters = mean(row(media.scattering, k))
        if scatters > most:
            enters, leaves = box_span(row(media.low, k), row(media.high, k), origin, direction, far)
            if enters < leaves:
                most, found = scatters, k
    return found


@part
def _angle(media, k, first, last, number):
    """An angle between two by the k-th volume's phase function, and its density."""
    step = (last - first) / np.float32(_N_INTERVALS)
    total, before = ZERO, phase_density(media, k, -np.sin(first))
    for i in range(_N_INTERVALS):
        after = phase_density(media, k, -np.sin(first + np.float32(i + 1) * step))
        total, before = total + _HALF * (before + after), after
    # The interval in which the integral reaches its share, and where in it
    left, before = number * total, phase_density(media, k, -np.sin(first))
    for i in range(_N_INTERVALS):
        after = phase_density(media, k, -np.sin(first + np.float32(i + 1) * step))
        within = _HALF * (before + after)
        if left < within or i == _N_INTERVALS - 1:
            break
        left, before = left - within, after
    left = min(left, within)
    x = min(TWO * left / (before + np.sqrt(max(before * before + TWO * (after - before) * left, ZERO))), ONE)
    return first + (np.float32(i) + x) * step, (before + x * (after - before)) / (total * step)
