"""Photons between surfaces: media scatter and absorb them, until they meet a surface or are gone.

What a medium has scattered no points of lights find: it is stored as indirect light where it meets its first surface.
What came to the medium over mirrors or through glass no rays find either: it is a part of the caustics there.
"""

import numpy as np

from ..core.compiling import kernel, part
from ..core.sampling.path_numbers import two_numbers
from ..core.vec3 import BLACK, ONE, along, largest, mul, put, times
from ..scene import RayKind
from ..tracing.embree import INFINITY, intersect
from ..tracing.media.flight import fly
from ..tracing.media.scattering import sample_phase
from ..tracing.transparency import stopped
from .front import dispersed, photon_at, put_photon

_MAX_SCATTERINGS = 1 << 10
_STREAM = np.uint64(0xA0761D6478BD642F)  # that their numbers are apart from those of surfaces
_DIFFUSE = int(RayKind.DIFFUSE)


@kernel
def pass_media(tracing, room, key, bounce, front, n, hits):
    """Move n photons of a front on through media to the surfaces that they meet; `hits` becomes those."""
    for k in range(n):
        photon = photon_at(front, k)
        stop = hits.triangle[k], hits.distance[k], hits.u[k], hits.v[k]
        photon, left, stop = _flown(tracing, room, key, bounce, photon, stop)
        put_photon(front, k, photon)
        put(front.power, k, mul(photon.power, left))
        hits.triangle[k], hits.distance[k], hits.u[k], hits.v[k] = stop


@part
def _flown(tracing, room, key, bounce, photon, stop):
    """A photon on its last way through media, what is left of its power then, and the surface there (−1: none)."""
    for step in range(_MAX_SCATTERINGS):
        if photon.power == BLACK:
            break
        flight = fly(tracing, room, photon.origin, photon.direction, stop[1])
        if flight.volume < 0:
            return photon, flight.weight, stop
        # Russian roulette, so that no photon gains power
        i = 2 * (_MAX_SCATTERINGS * np.int64(bounce) + step)
        u, v = two_numbers(key ^ _STREAM, photon.path, i)
        fate, _ = two_numbers(key ^ _STREAM, photon.path, i + 1)
        survival = min(largest(flight.weight), ONE)
        if fate >= survival:
            break
        origin = along(photon.origin, flight.distance, photon.direction)
        direction = sample_phase(tracing.media, flight.volume, photon.direction, u, v)
        first = intersect(tracing.trees[_DIFFUSE], room, origin, direction, INFINITY)
        triangle, distance, a, b, tint = stopped(tracing, room, origin, direction, _DIFFUSE, photon.kind, True, first)
        weight = times(mul(flight.weight, tint), ONE / survival)
        photon = dispersed(photon, origin, direction, mul(photon.power, weight), survival)
        stop = triangle, distance, a, b
    return photon, BLACK, stop
