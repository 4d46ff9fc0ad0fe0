"""What photons cost by the number of lamps that emit them, and the memory that stored ones take.

python tests/bench/run.py --only lamps
"""

from time import process_time

import numpy as np
from figures import table
from memory import extra_memory
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.emitters import light_sources, region_of
from photon_bake.addon.photons import trace_photons
from photon_bake.addon.scene import LightKind, Lights
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, lamp, scene_of

N_LAMPS = (1, 60, 1000)
N_PHOTONS, N_TIMES = 200_000, 3
MANY_PHOTONS = (1_000_000, 4_000_000)
TIME_HEAD = ["Lamps", "Photons", "Stored", "ns a photon, one thread", "Over one lamp"]
MEMORY_HEAD = ["Photons", "Stored", "MB more at the most", "Bytes a stored photon"]


def room(n_lamps):
    """A white room with point lamps of one power together, and what traces photons in it."""
    places = np.random.default_rng(0).uniform(-0.9, 0.9, (n_lamps, 3))
    lights = Lights.join([lamp(LightKind.POINT, 1 / n_lamps, position=place) for place in places])
    scene = scene_of(*box(), albedo=0.7, lights=lights)
    return scene, TransparencyTracer(scene, EmbreeTracer(scene)), light_sources(scene, region_of(scene.vertices))


def seconds(at, n_photons):
    """Photons stored, and the least of the processor's time that they took."""
    times = []
    for _ in range(N_TIMES + 1):  # the first compiles
        start = process_time()
        photons = trace_photons(*at, n_photons, 32, Workers(n_threads=1))
        times.append(process_time() - start)
    return len(photons), min(times)


def time_rows():
    of_one = None
    for n_lamps in N_LAMPS:
        n_stored, time = seconds(room(n_lamps), N_PHOTONS)
        of_one = of_one or time
        yield [
            f"{n_lamps:,}",
            f"{N_PHOTONS:,}",
            f"{n_stored:,}",
            f"{time / N_PHOTONS * 1e9:.0f}",
            f"{time / of_one:.2f}",
        ]


def memory_rows():
    at = room(1)
    for n_photons in MANY_PHOTONS:
        photons, memory = extra_memory(lambda n=n_photons: trace_photons(*at, n, 32, Workers(n_threads=1)))
        each = "" if memory is None else f"{memory * 1e6 / len(photons):.0f}"
        yield [f"{n_photons:,}", f"{len(photons):,}", "" if memory is None else f"{memory:.0f}", each]


def tables(*_):
    """Markdown tables."""
    return [
        table("Photons by the number of lamps", TIME_HEAD, list(time_rows())),
        table("Memory of photons", MEMORY_HEAD, list(memory_rows())),
    ]
