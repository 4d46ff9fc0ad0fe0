"""Measures what the engine's rays cost against Embree's own time for the same rays.

    python tests/bench/run.py --only rays [--scene NAME]

Photons are a guided million. Gather rays are a million that records send, with the look-up in the cache and what comes
of it: near hits, gloss, shadow rays. The tracer's are a million first hits and a million shadow rays with nothing else,
once more with surfaces that let half of the light through. Embree's time is that of its own calls alone, made again
with the same rays. Of one thread it is the processor's time that counts, of all cores the clock's. A scene with gloss
or glass is measured a second time without, which tells what these cost.
"""

import os
from dataclasses import dataclass, replace
from time import perf_counter, process_time
from unittest import mock

import numpy as np
from figures import load, table
from photon_bake.addon.core import parallel
from photon_bake.addon.core.parallel import Turns, Workers, slices
from photon_bake.addon.core.sampling.warps import sample_cosine_hemisphere, to_world
from photon_bake.addon.emitters import Sphere, light_sources, region_of
from photon_bake.addon.gather import DirectLight, GatherRays, build_radiance_cache, importance_pilot
from photon_bake.addon.gather.irradiance_cache.records import RecordMaker
from photon_bake.addon.photons import guide_sources, pilots_for, trace_photons
from photon_bake.addon.receivers import Receivers
from photon_bake.addon.scene import Channel, Lobe, Scene
from photon_bake.addon.settings.bake import BakeSettings
from photon_bake.addon.tracing import EmbreeTracer, TransparencyTracer
from ray_recorder import recorded

N_RECORDS, N_RAYS = 8192, 128  # a record of medium quality sends so many rays at first
N_TIMES = 3
N_PLAIN_RAYS, CHUNK, LIFT = 1 << 20, 1 << 14, np.float32(1e-4)

RATES_HEAD = ["Scene", "Rays of", "Rays", "Shadow rays among them", "Ours, M/s", "Embree, M/s", "Ours over Embree"]
RATES_HEAD += ["Ours on all cores, M/s", "Embree on all cores, M/s", "Ours over Embree on all cores"]


@dataclass(frozen=True)
class Engine:
    """What a bake at medium quality has made when it begins to gather: guided sources, and rays with their cache."""

    scene: Scene
    receivers: Receivers
    tracer: EmbreeTracer
    sources: list
    target: Sphere
    rays: GatherRays

    @staticmethod
    def of(scene, receivers):
        settings, workers, tracer = BakeSettings(), Workers(), EmbreeTracer(scene)
        light_tracer = TransparencyTracer(scene, tracer)
        region = region_of(receivers.position)
        pilot = importance_pilot(scene, light_tracer, receivers, region, settings.n_cache_elements, workers)
        target, n_photons, n_bounces = pilot.target_region, settings.n_photons, settings.max_bounces

        def importance(photons):
            return pilot.importance(scene, photons)

        sources = light_sources(scene, region)
        n_pilots = pilots_for(n_photons)
        guided = guide_sources(scene, light_tracer, sources, n_pilots, n_bounces, importance, workers, target)
        photons = trace_photons(scene, light_tracer, guided, n_photons, n_bounces, workers, region=target)
        direct = DirectLight(scene, light_tracer, sources)
        n_rays = settings.n_cache_rays
        cache = build_radiance_cache(scene, light_tracer, photons, direct, pilot, n_rays, workers)
        return Engine(scene, receivers, tracer, guided, target, GatherRays(scene, light_tracer, direct, cache))

    def trace(self, workers):
        """Trace a million photons."""
        settings, tracer = BakeSettings(), TransparencyTracer(self.scene, self.tracer)
        n_photons, n_bounces = settings.n_photons, settings.max_bounces
        trace_photons(self.scene, tracer, self.sources, n_photons, n_bounces, workers, region=self.target)

    def gather(self, workers):
        """Send a million gather rays."""
        chosen = spread(self.receivers, N_RECORDS)
        RecordMaker(self.rays, self.receivers, N_RAYS, Turns(workers)).records(chosen, 0.0)


def spread(receivers, n):
    """Indices of n receivers, evenly from first to last."""
    return np.linspace(0, len(receivers), n, endpoint=False).astype(int)


def measure(work):
    """Cells of `RATES_HEAD` for rays that ``work(workers)`` sends."""
    in_order = mock.patch.object(parallel, "ordered_map", lambda function, items, n_threads: map(function, items))
    with in_order:
        rays = recorded(lambda: work(Workers(n_threads=1)))
    n, rates = len(rays.rows), []
    for n_threads, clock in ((1, process_time), (os.cpu_count(), perf_counter)):
        ours, embree = least_seconds(work, rays, n_threads, clock)
        rates += [f"{n / ours / 1e6:.2f}", f"{n / embree / 1e6:.2f}", f"{ours / embree:.2f}"]
    return [f"{n:,}", f"{rays.n_shadow_rays:,}", *rates]


def least_seconds(work, rays, n_threads, clock):
    """Ours and Embree's alone, the least of several tries that take turns, as other work comes and goes."""
    tries = []
    for _ in range(N_TIMES):
        ours = seconds(lambda: work(Workers(n_threads=n_threads)), clock)
        tries.append((ours, seconds(lambda: rays.replay(n_threads), clock)))
    return map(min, zip(*tries, strict=True))


def seconds(function, clock):
    start = clock()
    function()
    return clock() - start


def matte(scene):
    """The scene without its glossy and glass lobes."""
    closures = scene.materials.closures
    bare = closures.where(closures.kind < Lobe.GLOSSY)
    return replace(scene, materials=replace(scene.materials, closures=bare))


def variants(scenes):
    """Name, scene and receivers of each scene, and of its matte twin if it has gloss or glass."""
    for name, path in scenes.items():
        scene, receivers, _ = load(path)
        yield name, scene, receivers
        if scene.materials.narrow[scene.material_of_triangle].any():
            yield f"{name}, matte", matte(scene), receivers


def half_open(scene):
    """The scene with surfaces that let half of the light through."""
    half = Channel.constant(np.full(len(scene.materials), 0.5))
    return replace(scene, materials=replace(scene.materials, coverage=half))


def plain_rays(scene, receivers):
    """What sends a million rays from receivers through a scene, and as many to points that they see or do not."""
    tracer, random = TransparencyTracer(scene, EmbreeTracer(scene)), np.random.default_rng(1)
    at, to = (random.integers(0, len(receivers), N_PLAIN_RAYS) for _ in range(2))
    normals, origins = receivers.normal[at], receivers.position[at] + LIFT * receivers.normal[at]
    targets = receivers.position[to] + LIFT * receivers.normal[to]
    directions = to_world(sample_cosine_hemisphere(random.random((len(at), 2), np.float32)), normals)

    def closest(workers):
        for _ in workers.map(lambda k: tracer.closest_hit(origins[k], directions[k]), slices(len(at), CHUNK)):
            pass

    def visible(workers):
        for _ in workers.map(lambda k: tracer.visibility(origins[k], targets[k]), slices(len(at), CHUNK)):
            pass

    return closest, visible


def tables(scenes, options):
    """Markdown tables."""
    chosen = {name: path for name, path in scenes.items() if name in (options.scene or scenes)}
    rates = []
    for name, scene, receivers in variants(chosen):
        engine = Engine.of(scene, receivers)
        for what, work in (("photons", engine.trace), ("gather", engine.gather)):
            rates.append([name, what, *measure(work)])
        for kind, surfaces in (("", scene), (", half see-through", half_open(scene))):
            closest, visible = plain_rays(surfaces, receivers)
            rates.append([name + kind, "the tracer: first hits", *measure(closest)])
            rates.append([name + kind, "the tracer: visibility", *measure(visible)])
    title = "Rays against Embree's own time for the same rays, one thread and all cores"
    return [table(title, RATES_HEAD, rates)]
