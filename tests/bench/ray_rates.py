"""Measures what the engine's rays cost against Embree's own time for the same rays, and what the rest goes to.

    python tests/bench/run.py --only rays [--scene NAME]

Photons are a guided million. Gather rays are a million that records send, with the look-up in the cache and what comes
of it: near hits, gloss, shadow rays. Embree's time is that of its own calls alone, made again with the same arrays. Of
one thread it is the processor's time that counts, of all cores the clock's. A scene with gloss or glass is measured a
second time without, which tells what these cost.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from time import perf_counter, process_time
from unittest import mock

import numpy as np
from figures import load, table
from photon_bake.addon.bsdf import Surface, base_transmittance, glossy_albedo, surface_at
from photon_bake.addon.core import parallel
from photon_bake.addon.core.parallel import Turns, Workers
from photon_bake.addon.core.sampling.octahedral import encode_octahedral
from photon_bake.addon.core.sampling.streams import sobol_chunks
from photon_bake.addon.emitters import Sphere, light_sources, region_of
from photon_bake.addon.gather import DirectLight, GatherRays, RadianceCache, build_radiance_cache, survey_surfaces
from photon_bake.addon.gather.direct.ray_directions import gather_directions
from photon_bake.addon.gather.irradiance_cache.records import RecordMaker
from photon_bake.addon.gather.rays.gather_rays import _Paths
from photon_bake.addon.photons import GuidedSource, Photons, guide_sources, pilots_for, trace_photons
from photon_bake.addon.photons.scattering import facing, local_axes, scatter
from photon_bake.addon.receivers import Receivers
from photon_bake.addon.scene import Lobe, Scene
from photon_bake.addon.settings.bake import BakeSettings
from photon_bake.addon.tracing import Hits, TransparencyTracer, embree
from photon_bake.addon.tracing.embree import EmbreeTracer, intersect_all, new_ray, occluded_all
from section_clock import section_shares

N_RECORDS, N_RAYS = 8192, 128  # a record of medium quality sends so many rays at first
N_TIMES = 3

RATES_HEAD = ["Scene", "Rays of", "Rays", "Shadow rays among them", "Ours, M/s", "Embree, M/s", "Ours over Embree"]
RATES_HEAD += ["Ours on all cores, M/s", "Embree on all cores, M/s", "Ours over Embree on all cores"]


class Recorder:
    """Embree's loops over rays, keeping what they are asked for, to be asked for again."""

    def __init__(self, calls):
        self._calls = calls

    def closest_hits(self, *arguments):
        self._keep(Call(intersect_all, arguments))

    def shadow_rays(self, *arguments):
        self._keep(Call(occluded_all, arguments))

    def _keep(self, call):
        self._calls.append(call)
        call.run()


@dataclass(frozen=True)
class Call:
    """Rays that Embree was asked for at once: the loop over them, and its arguments."""

    loop: object
    arguments: tuple

    def run(self):
        tree, _, *rays = self.arguments
        self.loop(tree, new_ray(), *rays)

    @property
    def n_rays(self):
        return len(self.arguments[2])

    @property
    def n_shadow_rays(self):
        return self.n_rays if self.loop is occluded_all else 0


# What time goes to; functions that only glossy and glass surfaces need are "Gloss", wherever they are called
SECTIONS = {
    "Embree": [Recorder.closest_hits],
    "Embree, shadow rays": [Recorder.shadow_rays],
    "Around Embree": [TransparencyTracer.closest_hit, TransparencyTracer.visibility, Hits.points],
    "Where rays start": [GuidedSource.emit, sobol_chunks, gather_directions],
    "Look-ups": [RadianceCache.look_up],
    "Near hits": [GatherRays._add_diffuse],
    "Lamps": [DirectLight.sample, DirectLight.met, DirectLight.unsampled_sky],
    "Gloss": [
        GatherRays._add_glossy,
        GatherRays._surface,
        surface_at,
        base_transmittance,
        glossy_albedo,
        facing,
        local_axes,
    ],
    "Scattering": [scatter],
    "Choosing rows": [Hits.where, Hits.put, Photons.where, Surface.where, _Paths.where, _Paths.at],
    "Storing": [encode_octahedral, Photons.join],
}
SHARES_HEAD = ["Scene", "Rays of", *SECTIONS, "Rest"]


@contextmanager
def recorded():
    """The calls of Embree meanwhile."""
    recorder = Recorder(calls := [])
    loops = {"intersect_all": recorder.closest_hits, "occluded_all": recorder.shadow_rays}
    with mock.patch.multiple(embree, **loops):
        yield calls


@dataclass(frozen=True)
class Engine:
    """What a bake at medium quality has made when it begins to gather: guided sources, and rays with their cache."""

    scene: Scene
    receivers: Receivers
    tracer: EmbreeTracer
    sources: list
    home: Sphere
    rays: GatherRays

    @staticmethod
    def of(scene, receivers):
        settings, workers, tracer = BakeSettings(), Workers(), EmbreeTracer(scene)
        light_tracer = TransparencyTracer(scene, tracer)
        region = region_of(receivers.position)
        survey = survey_surfaces(scene, light_tracer, receivers, region, settings.n_cache_elements, workers)
        home, n_photons, n_bounces = survey.home, settings.n_photons, settings.max_bounces

        def worth(photons):
            return survey.worth(scene, photons)

        sources = light_sources(scene, region)
        n_pilots = pilots_for(n_photons)
        guided = guide_sources(scene, light_tracer, sources, n_pilots, n_bounces, worth, workers, home)
        photons = trace_photons(scene, light_tracer, guided, n_photons, n_bounces, workers, region=home)
        direct = DirectLight(scene, light_tracer, sources)
        n_rays = settings.n_cache_rays
        cache = build_radiance_cache(scene, light_tracer, photons, direct, survey, n_rays, workers)
        return Engine(scene, receivers, tracer, guided, home, GatherRays(scene, light_tracer, direct, cache))

    def trace(self, workers):
        """Trace a million photons."""
        settings, tracer = BakeSettings(), TransparencyTracer(self.scene, self.tracer)
        n_photons, n_bounces = settings.n_photons, settings.max_bounces
        trace_photons(self.scene, tracer, self.sources, n_photons, n_bounces, workers, region=self.home)

    def gather(self, workers):
        """Send a million gather rays."""
        chosen = spread(self.receivers, N_RECORDS)
        RecordMaker(self.rays, self.receivers, N_RAYS, Turns(workers)).records(chosen, 0.0)


def spread(receivers, n):
    """Indices of n receivers, evenly from first to last."""
    return np.linspace(0, len(receivers), n, endpoint=False).astype(int)


def measure(work):
    """Cells of `RATES_HEAD` and of `SHARES_HEAD` for rays that ``work(workers)`` sends."""
    in_order = mock.patch.object(parallel, "ordered_map", lambda function, items, n_threads: map(function, items))
    with in_order, recorded() as calls:
        shares = section_shares(lambda: work(Workers(n_threads=1)), SECTIONS)
    n, n_shadow = sum(call.n_rays for call in calls), sum(call.n_shadow_rays for call in calls)
    rates = []
    for n_threads, clock in ((1, process_time), (os.cpu_count(), perf_counter)):
        ours, embree = least_seconds(work, calls, n_threads, clock)
        rates += [f"{n / ours / 1e6:.2f}", f"{n / embree / 1e6:.2f}", f"{ours / embree:.2f}"]
    return [f"{n:,}", f"{n_shadow:,}", *rates], [f"{share:.0%}" for share in shares.values()]


def least_seconds(work, calls, n_threads, clock):
    """Ours and Embree's alone, the least of several tries that take turns, as other work comes and goes."""
    tries = []
    for _ in range(N_TIMES):
        ours = seconds(lambda: work(Workers(n_threads=n_threads)), clock)
        tries.append((ours, seconds(lambda: replay(calls, n_threads), clock)))
    return map(min, zip(*tries, strict=True))


def seconds(function, clock):
    start = clock()
    function()
    return clock() - start


def replay(calls, n_threads):
    """Embree's part of the work alone."""
    with ThreadPoolExecutor(n_threads) as pool:
        list(pool.map(Call.run, calls))


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
        if scene.materials.glossy_or_glass[scene.material_of_triangle].any():
            yield f"{name}, matte", matte(scene), receivers


def tables(scenes, options):
    """Markdown tables."""
    chosen = {name: path for name, path in scenes.items() if name in (options.scene or scenes)}
    rates, shares = [], []
    for name, scene, receivers in variants(chosen):
        engine = Engine.of(scene, receivers)
        for what, work in (("photons", engine.trace), ("gather", engine.gather)):
            rate, share = measure(work)
            rates.append([name, what, *rate])
            shares.append([name, what, *share])
    return [
        table("Rays against Embree's own time for the same rays, one thread and all cores", RATES_HEAD, rates),
        table("What bounds it: where one thread's time goes", SHARES_HEAD, shares),
    ]
