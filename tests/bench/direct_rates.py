"""Measures direct light of many lamps against Embree's own time for the same shadow rays, on one thread.

    python tests/bench/run.py --only direct [--scene NAME]

Sixty lamps of all kinds, at random in the scene's bounds, take the place of its own. Points are the scene's receivers,
each of which resamples them once; the processor's time counts.
"""

from dataclasses import replace
from time import process_time

import numpy as np
from figures import load, table
from photon_bake.addon.core.compiling import kernel
from photon_bake.addon.core.vec3 import put, row
from photon_bake.addon.emitters import light_sources, region_of
from photon_bake.addon.gather import DirectLight
from photon_bake.addon.gather.direct.sampling import DIFFUSE_RAY, sample_emitters
from photon_bake.addon.scene import AREA_LAMPS, LightKind, Lights, World
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer, new_ray, occluded_all

N_LAMPS, N_POINTS, N_TIMES = 60, 400_000, 5
HEAD = ["Scene", "Lamps", "Points", "Shadow rays", "Ours, M points/s", "Embree, M rays/s", "Ours over Embree"]
_SHADOW = 3


@kernel
def draw(direct, scene, positions, normals, objects, key, targets, lit):
    """Where the points' shadow rays go."""
    for k in range(len(positions)):
        at = row(positions, k), row(normals, k), objects[k], DIFFUSE_RAY
        drawn = sample_emitters(direct, scene, *at, True, key, k, 0)
        put(targets, k, drawn[0])
        lit[k] = drawn[3]


def many_lamps(bounds, n=N_LAMPS, seed=1):
    """Lamps of all kinds in turn, at random in a box."""
    random = np.random.default_rng(seed)
    kind = np.resize(np.array(list(LightKind)), n)
    direction = random.normal(size=(n, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    axis_x = np.cross(direction, np.roll(direction, 1, axis=1))
    axis_x /= np.linalg.norm(axis_x, axis=1, keepdims=True)
    point, area = kind <= LightKind.SPOT, np.isin(kind, list(AREA_LAMPS))
    return Lights.of(
        tuple(f"Lamp {k}" for k in range(n)),
        kind,
        emission=random.uniform(0.1, 1, (n, 3)) * np.where(kind == LightKind.SUN, 0.01, 1)[:, None],
        position=random.uniform(*bounds, (n, 3)),
        direction=direction,
        axis_x=axis_x,
        axis_y=np.cross(axis_x, direction),
        size=random.uniform(0.1, 1, (n, 2)) * area[:, None],
        radius=random.uniform(0, 0.2, n) * point,
        sphere=(random.random(n) < 0.5) & point,
        angle=np.where(kind == LightKind.SPOT, 1.5, np.where(kind == LightKind.SUN, 0.01, 0)),
        blend=np.where(kind == LightKind.SPOT, 0.2, 0),
    )


def least_seconds(*works):
    """Of each of several works the least of some tries that take turns, as other work comes and goes."""

    def seconds(work):
        start = process_time()
        work()
        return process_time() - start

    return map(min, zip(*([seconds(work) for work in works] for _ in range(1 + N_TIMES)), strict=True))


def measure(scene, receivers):
    """Cells of `HEAD` after the scene's name."""
    scene = replace(scene, lights=many_lamps(scene.bounds), world=World.constant(0))
    scene = scene.lit_by(np.ones(N_LAMPS, bool), np.zeros(len(scene.objects.names), bool), scene.world)
    tracer = TransparencyTracer(scene, EmbreeTracer(scene))
    direct = DirectLight(scene, tracer, light_sources(scene, region_of(receivers.position)))
    k = np.resize(np.arange(len(receivers)), N_POINTS)
    positions, normals, key = receivers.position[k], receivers.normal[k], np.uint64(1)

    targets, lit = np.empty_like(positions), np.empty(len(k), bool)
    draw(direct.arrays, scene.arrays, positions, normals, np.full(len(k), -1, np.int32), key, targets, lit)
    rays, blocked = (positions[lit], targets[lit]), np.empty(int(lit.sum()), bool)
    tree = tracer.surfaces.handles[_SHADOW]
    ours, embree = least_seconds(
        lambda: direct.mean_irradiance(positions, normals, None, 1, key, with_sky=False),
        lambda: occluded_all(tree, new_ray(), *rays, blocked),
    )
    rates = f"{len(k) / ours / 1e6:.2f}", f"{len(blocked) / embree / 1e6:.2f}", f"{ours / embree:.2f}"
    return [str(N_LAMPS), f"{len(k):,}", f"{len(blocked):,}", *rates]


def tables(scenes, options):
    """Markdown tables."""
    chosen = {name: path for name, path in scenes.items() if name in (options.scene or scenes)}
    rows = [[name, *measure(*load(path)[:2])] for name, path in chosen.items()]
    return [
        table("Direct light of many lamps against Embree's own time for the same shadow rays, one thread", HEAD, rows)
    ]
