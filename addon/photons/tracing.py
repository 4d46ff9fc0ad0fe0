"""Photons traced through a scene, many at a time."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ..bsdf import Lobe
from ..core.parallel import Workers, slices
from ..core.sampling.octahedral import encode_octahedral
from ..core.sampling.streams import PathNumbers, sobol_chunks, stream
from ..core.sampling.vectors import largest, rows
from ..emitters import Rays, Source, Sphere
from ..emitters.emission import N_DIMENSIONS
from ..scene import ALL_BOUNCES, RayKind, Scene, seen_by
from ..tracing import Hits, TransparencyTracer
from .bounce_map import View, view_of
from .emission_segment import first_flight
from .flights import FlightLog, Flights
from .photons import PathKind, Photons
from .region_directed import sent_home
from .scattering import scatter

CHUNK = 1 << 17
"""Photons that fly together: enough to hide Python's cost a call, few enough to stay in the processor's cache."""

_EVEN = 0.25  # of the photons is shared evenly: no source is left out, however little of it is found at first


class Pass(Enum):
    """What photons are traced for: the streams of random numbers of their emission and of their scattering.

    The pilots' photons are others than those that they guide, lest what is chosen depend on what it is chosen by.
    """

    PHOTONS = (1, 2)
    PILOTS = (4, 5)


@dataclass(frozen=True)
class _Batch:
    """Photons of one source that are traced together; each draws numbers of its own, so that frames are alike.

    Attributes
    ----------
    of : Pass
    """

    source: Source
    u: np.ndarray
    n_of_source: int
    first_path: int
    index: int
    of: Pass


def shares(sources: list[Source], n_photons: int) -> list[int]:
    """How many photons each source emits: a quarter of them evenly, the rest by importance, and at least one."""
    importance = np.array([source.importance for source in sources])
    even = np.full(len(sources), 1 / max(len(sources), 1))
    by_importance = importance / importance.sum() if importance.any() else even
    return [max(1, round(n_photons * share)) for share in _EVEN * even + (1 - _EVEN) * by_importance]


def trace_photons(
    scene: Scene,
    tracer: TransparencyTracer,
    sources: list[Source],
    n_photons: int,
    max_bounces: int,
    workers: Workers,
    in_pictures: bool = False,
    region: Sphere | None = None,
    on_gloss: bool = False,
    of: Pass = Pass.PHOTONS,
    log: FlightLog | None = None,
) -> Photons:
    """Photons that met surfaces with a diffuse or translucent lobe, and caustics on all surfaces.

    Where photons are scattered, Russian roulette absorbs some.

    Direct hits (`PathKind.DIRECT`) of sources that are sampled directly are not stored.

    Parameters
    ----------
    sources : list of Source
        From `light_sources`.
    n_photons : int
        Emitted by all sources together.
    max_bounces : int
        Surfaces that a photon may hit.
    in_pictures : bool
        Emit photons through the pixels of each source's bounce map, of which there may be a few more.
    region : Sphere, optional
        Where light is wanted: half of what is scattered outside of it comes home.
    on_gloss : bool
        Store those as well that met surfaces with other lobes alone.
    of : Pass
    log : FlightLog, optional
        Takes down photons' flights from the first surface on.

    Returns
    -------
    Photons
        The same for a seed whatever the number of threads.
    """
    counts = shares(sources, n_photons)
    batches = _batches(sources, counts, workers.seed, of)
    if in_pictures:
        batches = _pictures([view_of(source, scene) for source in sources], counts, workers.seed)
    keeps = scene.materials.spreads_light | on_gloss
    done, total = 0, sum(counts)
    workers.progress.update("Tracing photons", 0.0)
    parts = [Photons.none()]
    for n, part in workers.map(
        lambda batch: (len(batch.u), _trace_batch(scene, tracer, batch, max_bounces, workers.seed, region, keeps, log)),
        batches,
    ):
        parts.append(part)
        done += n
        workers.progress.update("Tracing photons", min(done / total, 1.0))
    return Photons.join(parts)


def emitted_rays(sources: list[Source], n_photons: int, seed: int) -> list[Rays]:
    """The rays on which `trace_photons` would start so many photons."""
    return [batch.source.emit(batch.u) for batch in _batches(sources, shares(sources, n_photons), seed, Pass.PHOTONS)]


def emitted_points(sources: list[Source], n_photons: int, seed: int, of: Pass) -> list[np.ndarray]:
    """The points of the hypercubes from which `trace_photons` would start, an array (n, 5) for each source."""
    points: list[list[np.ndarray]] = [[] for _ in sources]
    for batch in _batches(sources, shares(sources, n_photons), seed, of):
        points[sources.index(batch.source)].append(batch.u)
    return [np.concatenate(parts) for parts in points]


def bounces_left(sources: list[Source], n_photons: int, photons: Photons) -> np.ndarray | None:
    """How many surfaces further photons of `trace_photons` may be seen, (p,) int; None if all sources' are unlimited.

    Light that falls on a receiver has left none of its `max_bounces` behind, and at the b-th surface after the first
    it has left b.
    """
    limits = np.array([source.max_bounces for source in sources])
    if (limits >= ALL_BOUNCES).all():
        return None
    left: np.ndarray = np.repeat(limits, shares(sources, n_photons))[photons.path] - photons.bounce
    return left


def _batches(sources: list[Source], counts: list[int], seed: int, of: Pass) -> Iterator[_Batch]:
    first_path = index = 0
    for k, (source, count) in enumerate(zip(sources, counts, strict=True)):
        for u in sobol_chunks(N_DIMENSIONS, count, CHUNK, seed, of.value[0], k):
            yield _Batch(source, u, count, first_path, index, of)
            first_path, index = first_path + len(u), index + 1


def _pictures(views: list[View], counts: list[int], seed: int) -> Iterator[_Batch]:
    """As `_batches`, with a photon for each pixel of the views."""
    first_path = index = 0
    for k, (view, count) in enumerate(zip(views, counts, strict=True)):
        points = view.points(count, seed, k)
        for part in slices(len(points), CHUNK):
            u = points[part]
            yield _Batch(view, u, len(points), first_path, index, Pass.PHOTONS)
            first_path, index = first_path + len(u), index + 1


def _trace_batch(
    scene: Scene,
    tracer: TransparencyTracer,
    batch: _Batch,
    max_bounces: int,
    seed: int,
    region: Sphere | None,
    keeps: np.ndarray,
    log: FlightLog | None,
) -> Photons:
    """Emit a batch and follow it until every photon is absorbed, gone, or has hit `max_bounces` surfaces.

    Those on materials that `keeps` (m,) bool names are stored.
    """
    scattering = batch.of.value[1]
    random, of_paths = stream(seed, scattering, batch.index), PathNumbers(seed, scattering)
    source = batch.source
    rays = source.emit(batch.u)
    power = rays.flux / np.float32(batch.n_of_source)
    path = np.arange(batch.first_path, batch.first_path + len(batch.u), dtype=np.int32)
    origins, directions = rays.origins, rays.directions
    path_density = np.ones(len(path), np.float32)
    focused, gained = np.zeros(len(path), bool), np.ones(len(path), np.float32)
    came_from = rays.objects  # what photons left last; −1 for lamps and the world
    seen = np.stack([np.append(seen_by(scene.objects, kind), True) for kind in RayKind])
    stored = [Photons.none()]

    for bounce in range(min(max_bounces, source.max_bounces + 1)):
        # Find where the photons meet surfaces
        if bounce == 0:
            hits, power = first_flight(scene, tracer, source, origins, directions, power, random)
        else:
            hits = tracer.closest_hit(origins, directions)
            if log is not None:
                log.take(batch.index, Flights(origins, directions, hits.distance, power, focused))
            power = hits.tinted(power)
        hit = np.flatnonzero(hits.hit & (power != 0).any(axis=1))
        if len(hit) == 0:
            break
        hits, directions = hits.where(hit), rows(directions, hit)
        positions, normals = hits.points(scene, directions)
        power, path, path_density, focused = rows(power, hit), path[hit], path_density[hit], focused[hit]
        came_from, gained = came_from[hit], gained[hit]

        # Store them
        if bounce > 0 or not source.sampled_directly:
            kind = np.where(focused, PathKind.CAUSTIC, PathKind.INDIRECT if bounce else PathKind.DIRECT)
            on = np.flatnonzero(focused | keeps[scene.material_of_triangle[hits.triangle]])
            met, flown = hits.where(on), rows(directions, on)
            stored.append(
                Photons(
                    position=rows(positions, on),
                    power=rows(power, on),
                    packed_direction=encode_octahedral(flown),
                    packed_normal=_packed_normals(scene, met, flown),
                    triangle=met.triangle,
                    path=path[on],
                    path_density=path_density[on],
                    kind=kind[on].astype(np.uint8),
                    bounce=np.full(len(on), min(bounce, 255), np.uint8),
                )
            )

        # Scatter them, and let Russian roulette absorb some, so that no photon gains power
        scattered = scatter(scene, hits, positions, directions, normals, of_paths.of(path), from_light=True)
        # Seen from the receivers, a lobe is where a ray of its kind starts that has to see where the photon came from
        survival = np.minimum(largest(scattered.weight), 1) * seen[scattered.kind, came_from]
        alive = np.flatnonzero(of_paths.random(len(hit)) < survival)
        if len(alive) == 0:
            break
        survival = survival[alive]
        weight = rows(scattered.weight, alive) / survival[:, None]
        if region is not None:
            scattered, ratio = sent_home(scattered, positions, normals, region, of_paths, gained)
            weight *= ratio[alive, None]
            gained = gained * ratio
        power = rows(power, alive) * weight
        path, path_density = path[alive], path_density[alive] * survival
        origins, directions = rows(scattered.origins, alive), rows(scattered.directions, alive)
        came_from, gained = scene.object_of_triangle[hits.triangle[alive]], gained[alive]

        # A caustic starts where photons find the light better, and ends after the first surface that scatters widely
        narrow = scattered.focused[alive] & source.sampled_directly if bounce == 0 else focused[alive]
        focused = narrow & (scattered.lobe[alive] >= Lobe.GLOSSY)
    return Photons.join(stored)


def _packed_normals(scene: Scene, hits: Hits, directions: np.ndarray) -> np.ndarray:
    return rows(scene.packed_normals.reshape(-1, 2), 2 * hits.triangle + hits.back(directions))
