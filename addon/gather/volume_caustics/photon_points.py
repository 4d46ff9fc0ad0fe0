"""Points where media have scattered photons that came over specular surfaces, and media after these, alone."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from ...core.compiling import kernel
from ...core.parallel import Workers, slices
from ...core.sampling.path_numbers import path_key, two_numbers
from ...core.sampling.vectors import rows
from ...core.vec3 import BLACK, ONE, along, largest, mul, put, row, times
from ...emitters import Source
from ...photons import GuidedSource
from ...photons.emission import Emission, Pass, shares
from ...photons.front import Front, new_front
from ...photons.guiding import pilots_for
from ...photons.media import pass_media
from ...photons.tracing import CHUNK, HitArrays, PhotonFlight, specular_flight
from ...scene import RayKind, Scene
from ...tracing import Hits, TransparencyTracer
from ...tracing.embree import new_ray
from ...tracing.media.forced import forced_scattering
from ...tracing.media.scattering import sample_phase
from ...tracing.transparency import closest_hit

_MOST_PHOTONS = 1 << 20
_MOST_SCATTERINGS = 8  # that leave points, of a photon between two surfaces
_DIFFUSE = int(RayKind.DIFFUSE)
_STREAM = 80  # of random numbers
_STAGE = "Tracing volume caustics"


@dataclass(frozen=True)
class MediaPoints:
    """p points where media have scattered light.

    Attributes
    ----------
    position, direction : (p, 3) float32
        Where, m, and unit directions in which the light came.
    power : (p, 3) float32, W
        That is scattered.
    volume : (p,) int32
        That scatters it.
    path : (p,) int32
        The photon.
    """

    position: np.ndarray
    direction: np.ndarray
    power: np.ndarray
    volume: np.ndarray
    path: np.ndarray

    def __len__(self) -> int:
        return len(self.path)

    def where(self, chosen: np.ndarray) -> "MediaPoints":
        """Those that a mask or an index array chooses."""
        return MediaPoints(*(rows(getattr(self, f.name), chosen) for f in fields(self)))

    @staticmethod
    def room_for(n: int) -> "MediaPoints":
        """Points that are not written yet."""
        position, direction, power = np.empty((3, n, 3), np.float32)
        return MediaPoints(position, direction, power, *np.empty((2, n), np.int32))

    @staticmethod
    def join(parts: "Sequence[MediaPoints]") -> "MediaPoints":
        """All points of several, in order."""
        parts = parts or [MediaPoints.room_for(0)]
        return MediaPoints(*(np.concatenate([getattr(one, f.name) for one in parts]) for f in fields(MediaPoints)))


def caustic_points(
    scene: Scene,
    tracer: TransparencyTracer,
    sources: Sequence[Source],
    n_photons: int,
    max_bounces: int,
    workers: Workers,
) -> MediaPoints:
    """Points of so many photons, or 2²⁰ if those are fewer, which fly to where a few first ones made caustics in media.

    Sources that gather rays find leave none.
    """
    n = min(n_photons, _MOST_PHOTONS)
    if not sources or not scene.materials.narrow.any() or not tracer.arrays.media.scatters.any():
        return MediaPoints.join([])
    counts = shares(sources, pilots_for(n))
    first = Emission(sources, counts, workers.seed, Pass.PILOTS)
    found = _traced(scene, tracer, sources, first, max_bounces, Pass.PILOTS, workers.part(0.0, 0.2))
    if len(found) == 0:
        return found
    power = np.bincount(found.path, np.abs(found.power).mean(axis=1), first.n)
    of_sources = np.split(power, np.cumsum(counts)[:-1])
    guided = [
        GuidedSource(source, first.points(i), counts[i] * of_source)
        for i, (source, of_source) in enumerate(zip(sources, of_sources, strict=True))
        if of_source.any()
    ]
    emission = Emission(guided, shares(guided, n), workers.seed, Pass.PHOTONS)
    return _traced(scene, tracer, guided, emission, max_bounces, Pass.PHOTONS, workers.part(0.2, 1.0))


def _traced(
    scene: Scene,
    tracer: TransparencyTracer,
    sources: Sequence[Source],
    emission: Emission,
    max_bounces: int,
    of: Pass,
    workers: Workers,
) -> MediaPoints:
    """The points of photons that sources emit."""
    flight = specular_flight(scene, tracer, sources, max_bounces, workers.seed, of)
    by_points = np.array([source.sampled_directly for source in sources])
    flight = replace(flight, rules=flight.rules._replace(sampled_directly=by_points))
    key = path_key(workers.seed, _STREAM, of.value[1])

    def batch(paths: slice) -> list[MediaPoints]:
        front = new_front(paths.stop - paths.start)
        emission.start(front, paths)
        return _flown(flight, front, paths.start, key)

    parts, done = list[MediaPoints](), 0
    for found in workers.map(batch, slices(emission.n, CHUNK)):
        parts, done = parts + found, min(done + CHUNK, emission.n)
        workers.progress.update(_STAGE, done / emission.n)
    return MediaPoints.join(parts)


def _flown(flight: PhotonFlight, front: Front, first: int, key: np.uint64) -> list[MediaPoints]:
    """The points that photons leave between two surfaces each, scattered apart from how they are on their way."""
    found, tracer = list[MediaPoints](), flight.tracer

    def watch(bounce: int, front: Front, n: int, hits: Hits) -> None:
        k = np.flatnonzero(front.specular[:n] & front.power[:n].any(axis=1)) if bounce else np.zeros(0, int)
        points = MediaPoints.room_for(_MOST_SCATTERINGS * len(k))
        columns = points.position, points.direction, points.power, points.volume, points.path
        n_points = _leave(tracer.arrays, new_ray(), key, bounce, front, hits.distance, k, columns)
        found.append(points.where(np.arange(n_points)))
        at = HitArrays(hits.triangle, hits.distance, hits.u, hits.v)
        pass_media(tracer.arrays, new_ray(), flight.rules.key, bounce, front, n, at)

    flight.fly(front, first, watch)
    return found


@kernel
def _leave(tracing, room, key, bounce, front, distances, chosen, points):
    """Have media scatter some photons of a front on their way to surfaces, until one is met or none scatters them.

    Returns how many points they have left.
    """
    positions, directions, powers, volumes, paths = points
    n = 0
    for j in range(len(chosen)):
        k = chosen[j]
        origin, direction, power, path = (
            row(front.origin, k),
            row(front.direction, k),
            row(front.power, k),
            front.path[k],
        )
        far = distances[k]
        for step in range(_MOST_SCATTERINGS):
            i = 3 * (_MOST_SCATTERINGS * np.int64(bounce) + step)
            place, choice = two_numbers(key, path, i)
            at = forced_scattering(tracing, room, origin, direction, far, place, choice)
            fate, _ = two_numbers(key, path, i + 1)
            survival = min(largest(at.weight), ONE)
            if at.volume < 0 or at.weight == BLACK or (step > 0 and fate >= survival):
                break
            power = times(mul(power, at.weight), ONE / survival if step > 0 else ONE)
            origin = along(origin, at.distance, direction)
            put(positions, n, origin)
            put(directions, n, direction)
            put(powers, n, power)
            volumes[n], paths[n] = at.volume, path
            n += 1
            u, v = two_numbers(key, path, i + 2)
            direction = sample_phase(tracing.media, at.volume, direction, u, v)
            _, far, _, _, tint = closest_hit(tracing, room, origin, direction, _DIFFUSE)
            power = mul(power, tint)
    return n
