"""Photons' whole paths in packed arrays: a row a photon, a column a surface that it met."""

from typing import NamedTuple

import numpy as np

from ....core.compiling import by_reference, kernel, part
from ....core.sampling.octahedral import octahedral_code
from ....core.vec3 import BLACK, ONE, ZERO, along, length, minus, put, row, times
from ....gather.radiance_cache.elements import element_at
from ....photons.emission import emitted_photon
from ....photons.viewers import reflects_to
from ....scene.hit import hit_at
from ..transport.crossings import crosses

N_SURFACES = 8
"""That a photon meets at most: what goes on after so many is left out."""

ABSENT, WAITING, KEPT, STALE, RENEWED = (np.uint8(state) for state in range(5))
"""States of a photon: never traced; traced, and not in the map; in the map of what is as it was; out of the map, since
an edit may have changed its path; traced again since, and in the map of those."""

_NOWHERE, _TINY, _CLOSE = np.int32(-1), np.float32(1e-20), np.float32(1e-3)


@by_reference
class PathArrays(NamedTuple):
    """The paths of n photons, each of up to `N_SURFACES` = m surfaces, 326 bytes a photon.

    Attributes
    ----------
    state : (n,) uint8
    level : (n,) uint8
        Of the radii of a photon's kernel.
    origin, direction, emitted : (n, 3) float32, m and W
        As it left its source.
    n_surfaces : (n,) uint8
    position : (n, m, 3) float32, m
        Where it met them; the last is far away where it left the scene.
    normal : (n, m, 2) int16
        Octahedral codes of the geometric normals of the sides that it met.
    triangle : (n, m) int32
        −1 where it left the scene.
    side : (n, m) int32
        Of an element: front 2k, back 2k + 1.
    power : (n, m, 3) float32, W
        What it brings there; 0 where it came straight from its source.
    """

    state: np.ndarray
    level: np.ndarray
    origin: np.ndarray
    direction: np.ndarray
    emitted: np.ndarray
    n_surfaces: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    triangle: np.ndarray
    side: np.ndarray
    power: np.ndarray


def no_paths(n: int) -> PathArrays:
    """Room for paths, none of which is there; rows that are never written take no memory."""
    f, m = np.float32, N_SURFACES
    origin, direction, emitted = (np.empty((n, 3), f) for _ in range(3))
    small = np.zeros(n, np.uint8), np.zeros(n, np.uint8)
    met = np.empty((n, m, 3), f), np.empty((n, m, 2), np.int16)
    numbers = np.empty((n, m), np.int32), np.empty((n, m), np.int32)
    counts = np.zeros(n, np.uint8)
    return PathArrays(*small, origin, direction, emitted, counts, *met, *numbers, np.empty((n, m, 3), f))


@kernel
def start_paths(front, rows, out):
    """Write down how the photons of a front leave their sources, each into its row."""
    for k in range(len(rows)):
        put(out.origin, rows[k], row(front.origin, k))
        put(out.direction, rows[k], row(front.direction, k))
        put(out.emitted, rows[k], row(front.power, k))


@kernel
def record(scene, elements, viewers, bounce, front, n, hits, far, paths, rows, out):
    """Write down where the n photons of a front are stopped; `rows[j]` is for the photon `paths[j]`, which rise."""
    j = 0
    for k in range(n):
        while paths[j] != front.path[k]:
            j += 1
        i, triangle = rows[j], hits.triangle[k]
        out.n_surfaces[i], out.triangle[i, bounce], out.side[i, bounce] = bounce + 1, triangle, _NOWHERE
        put(out.power[i], bounce, BLACK)
        if triangle < 0:
            put(out.position[i], bounce, along(row(front.origin, k), far, row(front.direction, k)))
            continue
        hit = hit_at(scene, row(front.direction, k), triangle, hits.distance[k], hits.u[k], hits.v[k])
        put(out.position[i], bounce, hit.position)
        out.normal[i, bounce, 0], out.normal[i, bounce, 1] = octahedral_code(hit.normal)
        out.side[i, bounce] = 2 * element_at(elements, triangle, hit.u, hit.v) + np.int32(hit.back)
        if front.specular[k] and reflects_to(viewers, front.kind[k]):
            put(out.power[i], bounce, row(front.power, k))


@part
def is_there(paths, i):
    """Whether a photon's path is known to be what it is."""
    return paths.state[i] != ABSENT and paths.state[i] != STALE


@kernel
def mark_crossing(boxes, start, stop, paths, marked):
    """Mark which of the paths from `start` to `stop` have a segment that crosses one of boxes (b, 2, 3)."""
    for i in range(start, stop):
        if marked[i] or not is_there(paths, i):
            continue
        origin = row(paths.origin, i)
        for k in range(paths.n_surfaces[i]):
            if marked[i]:
                break
            end = row(paths.position[i], k)
            way = minus(end, origin)
            far = length(way)
            direction = times(way, ONE / max(far, _TINY))
            for box in range(len(boxes)):
                if crosses(row(boxes[box], 0), row(boxes[box], 1), origin, direction, far):
                    marked[i] = True
            origin = end


@kernel
def mark_emission(emitters, seeds, first, start, stop, paths, marked, scaled):
    """Mark which photons leave their sources otherwise than before, and which on the same way with another power."""
    source = np.int64(0)
    for i in range(start, stop):
        while i >= first[source + 1]:
            source += 1
        if marked[i] or not is_there(paths, i):
            continue
        origin, direction, power, _ = emitted_photon(emitters, seeds, first, source, np.int64(i))
        was = row(paths.emitted, i)
        if power == was and power == BLACK:
            continue
        same = origin == row(paths.origin, i) and direction == row(paths.direction, i)
        for c in range(3):
            same = same and (power[c] == ZERO) == (was[c] == ZERO)
        marked[i], scaled[i] = not same, same and power != was


@kernel
def scale_paths(emitters, seeds, first, chosen, paths):
    """Give the power to chosen photons, whose numbers rise, that their sources have now."""
    source = np.int64(0)
    for j in range(len(chosen)):
        i = chosen[j]
        while i >= first[source + 1]:
            source += 1
        _, _, power, _ = emitted_photon(emitters, seeds, first, source, np.int64(i))
        for c in range(3):
            was = paths.emitted[i, c]
            share = power[c] / was if was != ZERO else ONE
            for k in range(paths.n_surfaces[i]):
                paths.power[i, k, c] *= share
            paths.emitted[i, c] = power[c]


@kernel
def differing(paths, rows, others, other_rows, differs):
    """Whether paths of some rows, (m,), end elsewhere or bring something else than others of other rows."""
    for j in range(len(rows)):
        i, o = rows[j], other_rows[j]
        differs[j] = paths.n_surfaces[i] != others.n_surfaces[o]
        for k in range(paths.n_surfaces[i]):
            if differs[j]:
                break
            off = length(minus(row(paths.position[i], k), row(others.position[o], k)))
            was, now = row(paths.power[i], k), row(others.power[o], k)
            more = abs(now[0] - was[0]) + abs(now[1] - was[1]) + abs(now[2] - was[2])
            differs[j] = off > _CLOSE or more > _CLOSE * (abs(was[0]) + abs(was[1]) + abs(was[2]))
