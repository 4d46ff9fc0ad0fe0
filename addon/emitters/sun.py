"""Suns: parallel light of irradiance E from a disc of the full angle α, behind everything.

E = ∫ L cos θ dω = πL sin²(α/2) over the disc, while the beams' own cross-sections add up to ∫ L dω = 2πL(1 − cos(α/2)),
which is E · 2/(1 + cos(α/2)).
"""

import numpy as np

from ..core.compiling import part, routine
from ..core.sampling.warps import PI, TWO_PI, at_versine
from ..core.vec3 import ONE, TWO, ZERO, along, dot, minus, negative, row, times, to_world
from ..scene import Lights
from .aiming.discs import Discs, through_discs
from .row import SourceRow

_BEHIND_ALL = np.finfo(np.float32).max
"""Distance of suns, m: nearer than nothing."""

_TINY = np.float32(1e-12)


def sun_row(lights: Lights, lamp: int, discs: Discs) -> SourceRow:
    """How a sun emits photons; its power is what enters the region of the receivers."""
    versine = 1 - np.cos(float(lights.angle[lamp]) / 2)
    power = lights.emission[lamp].astype(np.float64) * 2 / (2 - versine) * discs.area_of_region
    cells = (1, 1, 64, 64, len(discs.radii) + 1)
    return SourceRow(int(lights.kind[lamp]), lamp, cells, power, lights.direction[lamp], versine)


@routine
def emit_sun(emitters, source, u):
    """A direction uniform over the disc, a place by the nested discs."""
    lamps, lamp = emitters.lamps, emitters.lamp[source]
    direction = to_world(at_versine(u[0] * emitters.versine[source], u[1]), row(emitters.axis, source))
    origin, area = through_discs(emitters, source, direction, u)
    return origin, direction, times(row(lamps.emission, lamp), _beam(lamps, lamp) * area)


@part
def sample_sun(lamps, lamp, position, u, v, far):
    """As `sample_point`: directions uniform over the disc."""
    way = negative(to_world(at_versine(u * lamps.versine[lamp], v), row(lamps.direction, lamp)))
    return along(position, far, way), way, _beam(lamps, lamp)


@part
def meet_sun(lamps, lamp, direction):
    """As `meet_point`."""
    axis, versine = row(lamps.direction, lamp), max(lamps.versine[lamp], _TINY)
    sin2, cosine = versine * (TWO - versine), -dot(direction, axis)
    aside = minus(direction, times(axis, -cosine))
    return dot(aside, aside) < sin2 and cosine > ZERO, _BEHIND_ALL, ONE / (PI * sin2), ONE / (TWO_PI * versine)


@part
def _beam(lamps, lamp):
    """Share of a sun's emission in its beams across their own directions."""
    return TWO / (TWO - lamps.versine[lamp])
