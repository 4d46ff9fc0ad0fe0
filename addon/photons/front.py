"""Photons in flight: a wavefront of them as arrays, and one of them as kernels have it in hand."""

from typing import NamedTuple

import numpy as np

from ..core.compiling import by_reference, part
from ..core.vec3 import put, row
from ..scene import RayKind


class Photon(NamedTuple):
    """A photon on its way.

    Attributes
    ----------
    origin, direction, power : triples, m and W
    path_density : float32
        Probability that Russian roulette let the path come this far.
    gained : float32
        By what region-directed scattering has multiplied the power so far.
    specular : bool
        It came from its light over specular surfaces only, and after one of them maybe through media, so that it makes
        caustics.
    dispersed : bool
        A medium has scattered it, so that no points of lights find what it carries.
    came_from : int32
        The object that it left last, −1 for lamps and the world.
    path, source : int32
    kind : uint8
        `RayKind` of those who are going to see where it comes from (`viewers`).
    """

    origin: tuple
    direction: tuple
    power: tuple
    path_density: np.float32
    gained: np.float32
    specular: bool
    dispersed: bool
    came_from: int
    path: int
    source: int
    kind: np.uint8


@by_reference
class Front(NamedTuple):
    """n photons in flight: the attributes of `Photon` as arrays, (n, 3) and (n,)."""

    origin: np.ndarray
    direction: np.ndarray
    power: np.ndarray
    path_density: np.ndarray
    gained: np.ndarray
    specular: np.ndarray
    dispersed: np.ndarray
    came_from: np.ndarray
    path: np.ndarray
    source: np.ndarray
    kind: np.ndarray


def new_front(n: int) -> Front:
    """Room for n photons, which come from their sources."""
    f, i = np.float32, np.int32
    origin, direction, power = (np.empty((n, 3), f) for _ in range(3))
    one = np.ones(n, f), np.ones(n, f)
    came_from, path, source = np.full(n, -1, i), np.empty(n, i), np.empty(n, i)
    kind = np.full(n, RayKind.DIFFUSE, np.uint8)
    return Front(origin, direction, power, *one, np.zeros(n, bool), np.zeros(n, bool), came_from, path, source, kind)


@part
def photon_at(front, k):
    """The k-th photon of a front."""
    return Photon(
        row(front.origin, k),
        row(front.direction, k),
        row(front.power, k),
        front.path_density[k],
        front.gained[k],
        front.specular[k],
        front.dispersed[k],
        front.came_from[k],
        front.path[k],
        front.source[k],
        front.kind[k],
    )


@part
def put_photon(front, k, photon):
    """Write a photon into the k-th place of a front."""
    put(front.origin, k, photon.origin)
    put(front.direction, k, photon.direction)
    put(front.power, k, photon.power)
    front.path_density[k], front.gained[k], front.specular[k] = photon.path_density, photon.gained, photon.specular
    front.dispersed[k], front.came_from[k] = photon.dispersed, photon.came_from
    front.path[k], front.source[k], front.kind[k] = photon.path, photon.source, photon.kind


@part
def dispersed(photon, origin, direction, power, survival):
    """The photon after a medium has scattered it, which Russian roulette let survive."""
    return Photon(
        origin,
        direction,
        power,
        photon.path_density * survival,
        photon.gained,
        photon.specular,
        True,
        photon.came_from,
        photon.path,
        photon.source,
        photon.kind,
    )
