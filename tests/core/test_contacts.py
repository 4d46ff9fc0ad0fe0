"""Lightmaps where surfaces meet: light by interpolation against that of rays from every texel, into the same cache."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.emitters import region_of
from photon_bake.addon.gather import FinalGather, SampleBudget
from photon_bake.addon.pipeline.bake import solve
from photon_bake.addon.receivers import texel_receivers
from photon_bake.addon.scene import LightKind
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, lamp, merge, scene_of
from photon_bake.tests.core.unwrapped import unwrapped_plane

SIZE = 40  # texels along the floor, which is 2 m wide
NEAR = 3 * 2 / SIZE  # m


def block(low, high):
    vertices, triangles = box(0.5, inwards=False)
    low, high = np.array(low, np.float32), np.array(high, np.float32)
    return (low + high) / 2 + vertices * (high - low), triangles


def column(radius, n=24):
    """From floor to ceiling, and two triangles a side."""
    angle = np.arange(n) * 2 * np.pi / n
    ring = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    k, after = np.arange(n), (np.arange(n) + 1) % n
    sides = np.concatenate([np.stack([k, after, after + n], 1), np.stack([k, after + n, k + n], 1)])
    rings = [np.column_stack([ring, np.full(n, z)]) for z in (-1, 1)]
    return np.concatenate(rings).astype(np.float32), sides


THINGS = {
    "box": (block((-0.3, -0.3, -1), (0.3, 0.3, -0.2)), lambda at: np.abs(at[:, :2]).max(axis=1) - 0.3),
    "wall": (block((-0.01, -1, -1), (0.01, 1, 1)), lambda at: np.abs(at[:, 0]) - 0.01),
    "column": (column(0.2), lambda at: np.hypot(at[:, 0], at[:, 1]) - 0.2),
}


def both_bakes(thing):
    """Places on a floor near a thing on it and its walls; light by default, by all; the difference's standard error."""
    lights = lamp(LightKind.RECTANGLE, 3.0, (0.6, 0, 0.99), size=(0.4, 0.4))
    scene = scene_of(*merge(box(), thing[0]), albedo=0.5, lights=lights)
    tracer, floor = EmbreeTracer(scene), unwrapped_plane(0.5)
    floor = replace(floor, positions=floor.positions - np.float32([0, 0, 1]))
    receivers, texels = texel_receivers([floor], [(SIZE, SIZE)], tracer)
    at, hidden = receivers.position, texels.chart >= texels.charts.n_charts
    to_walls = 1 - np.abs(at[:, :2]).max(axis=1)
    k = np.flatnonzero(~hidden & (np.minimum(thing[1](at), to_walls) < NEAR))
    settings = settings_for("medium", n_photons=200_000, n_cache_elements=5_000)
    solution, extent = solve(scene, receivers, settings, tracer), 2 * region_of(at).radius

    def gathered(some, effort, seed):
        light = FinalGather(solution.rays, some, effort, extent, solution.tracer.surfaces, Workers(seed)).finish().light
        return light.irradiance.mean(axis=1), light.stderr

    ours, stderr = gathered(receivers, SampleBudget(settings.n_gather_rays), 0)
    truth, known = gathered(receivers.where(k), SampleBudget(1024, interpolate=False), 1)
    return at[k], ours[k], truth, np.hypot(stderr[k], known)


@pytest.mark.parametrize("thing", THINGS.values(), ids=THINGS)
def test_light_close_to_contacts_is_off_by_what_is_said(thing):
    _, ours, truth, said = both_bakes(thing)
    ratio = np.abs(ours - truth) / np.maximum(said, 1e-3 * truth.mean())
    lit = truth > 0
    assert 0.6 < np.sqrt(np.mean(ratio[lit] ** 2)) < 1.5
    assert np.percentile(ratio, 99) < 3.8
    assert np.percentile(np.abs(ours - truth), 99) < 0.16 * truth.mean()


def test_no_light_goes_through_a_thin_wall_nor_darkness():
    """But for what elements of the cache, which the wall stands on, tell of both sides."""
    at, ours, truth, _ = both_bakes(THINGS["wall"])
    lit = at[:, 0] > 0
    assert ours[~lit].max() < 1.25 * truth[~lit].max() < 0.05 * truth[lit].mean()
    foot = lit & (at[:, 0] < 0.05)
    assert ours[foot].mean() == pytest.approx(truth[foot].mean(), rel=0.02)
    assert ours[foot].min() > 0.5 * truth[foot].min()
