"""Photons traced through a scene, many at a time."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..parallel import Workers
from ..sampling.octahedral import encode_octahedral
from ..sampling.streams import sobol_chunks, stream
from ..sampling.vectors import largest
from ..sampling.warps import sample_cosine_hemisphere, to_world
from ..scene import Scene
from ..tracers import Tracer
from .emission import N_DIMENSIONS, Rays, Source
from .photons import PathKind, Photons

CHUNK = 1 << 17
"""Photons that fly together: enough to hide Python's cost a call, few enough to stay in the processor's cache."""

_EMISSION, _SCATTERING = 1, 2  # streams of random numbers


@dataclass(frozen=True)
class _Batch:
    """Photons of one source that are traced together; all are emitted, and roulette draws from the batch's stream."""

    source: Source
    u: np.ndarray
    n_of_source: int
    first_path: int
    index: int


def shares(sources: list[Source], n_photons: int) -> list[int]:
    """How many photons each source emits: in proportion to its power, and at least one."""
    power = np.array([source.power.sum() for source in sources])
    return [max(1, round(n_photons * share)) for share in power / power.sum()]


def trace_photons(
    scene: Scene,
    tracer: Tracer,
    sources: list[Source],
    n_photons: int,
    max_bounces: int,
    workers: Workers,
) -> Photons:
    """Photons that met surfaces, after being scattered by Lambertian surfaces with Russian roulette.

    Direct hits (`PathKind.DIRECT`) of sources that are sampled directly are not stored.

    Parameters
    ----------
    sources : list of Source
        From `light_sources`.
    n_photons : int
        Emitted by all sources together.
    max_bounces : int
        Surfaces that a photon may hit.

    Returns
    -------
    Photons
        The same for a seed whatever the number of threads.
    """
    counts = shares(sources, n_photons)
    done, total = 0, sum(counts)
    workers.progress.update("Tracing photons", 0.0)
    parts = [Photons.none()]
    for n, part in workers.map(
        lambda batch: (len(batch.u), _trace_batch(scene, tracer, batch, max_bounces, workers.seed)),
        _batches(sources, counts, workers.seed),
    ):
        parts.append(part)
        done += n
        workers.progress.update("Tracing photons", done / total)
    return Photons.join(parts)


def _batches(sources: list[Source], counts: list[int], seed: int) -> Iterator[_Batch]:
    first_path = index = 0
    for k, (source, count) in enumerate(zip(sources, counts, strict=True)):
        for u in sobol_chunks(N_DIMENSIONS, count, CHUNK, seed, _EMISSION, k):
            yield _Batch(source, u, count, first_path, index)
            first_path, index = first_path + len(u), index + 1


def _trace_batch(scene: Scene, tracer: Tracer, batch: _Batch, max_bounces: int, seed: int) -> Photons:
    """Emit a batch and follow it until every photon is absorbed, gone, or has hit `max_bounces` surfaces."""
    random = stream(seed, _SCATTERING, batch.index)
    rays: Rays = batch.source.emit(batch.u)
    power = rays.flux / np.float32(batch.n_of_source)
    path = np.arange(batch.first_path, batch.first_path + len(batch.u), dtype=np.int32)
    origins, directions = rays.origins, rays.directions
    path_density = np.ones(len(path), np.float32)
    stored = [Photons.none()]

    for bounce in range(max_bounces):
        # Find where the photons meet surfaces
        hits = tracer.closest_hit(origins, directions)
        hit = np.flatnonzero(hits.hit)
        if len(hit) == 0:
            break
        hits, directions = hits.where(hit), directions[hit]
        positions, normals = hits.points(origins[hit], directions)
        power, path, path_density = power[hit], path[hit], path_density[hit]

        # Store them
        if bounce > 0 or not batch.source.sampled_directly:
            stored.append(
                Photons(
                    position=positions,
                    power=power,
                    packed_direction=encode_octahedral(directions),
                    packed_normal=scene.packed_normals[hits.triangle, hits.back(directions).astype(np.int8)],
                    triangle=hits.triangle,
                    path=path,
                    path_density=path_density,
                    kind=np.full(len(hit), PathKind.INDIRECT if bounce else PathKind.DIRECT, np.uint8),
                    bounce=np.full(len(hit), min(bounce, 255), np.uint8),
                )
            )

        # Let Russian roulette absorb some by the largest albedo, so that no photon gains power
        albedo = scene.albedo(hits.triangle, hits.u, hits.v)
        survival = largest(albedo)
        alive = np.flatnonzero(random.random(len(hit), dtype=np.float32) < survival)
        if len(alive) == 0:
            break
        survival = survival[alive]
        power = power[alive] * (albedo[alive] / survival[:, None])
        path, path_density = path[alive], path_density[alive] * survival

        # Scatter the others by cosine-weighted directions
        normals, positions = normals[alive], positions[alive]
        directions = to_world(sample_cosine_hemisphere(random.random((len(alive), 2), dtype=np.float32)), normals)
        origins = positions + scene.ray_offset(positions) * normals
    return Photons.join(stored)
