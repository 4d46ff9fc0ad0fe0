"""Density estimates that most receivers take from the records of a final gather."""

import numpy as np
import pytest
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.gather.density.density import PhotonDensity
from photon_bake.addon.gather.density.thinned_density import thinned_density
from photon_bake.addon.gather.irradiance_cache import FinalGather, SampleBudget
from photon_bake.addon.gather.rays.gather_rays import Incoming
from photon_bake.addon.receivers import Receivers
from photon_bake.addon.tracing import Hits, TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import plane, scene_of
from photon_bake.tests.core.test_photon_splatting import photons_at

UP = np.array([0, 0, 1], np.float32)
HALF, K = 2.0, 50


class NoLight:
    """Gather rays that meet nothing, in the dark."""

    n_lights = 1

    def on_bodies(self, receivers):
        return None

    def radiance_of_paths(self, origins, directions, key, first, kind):
        return Incoming(np.zeros_like(origins), Hits.none(len(origins)))


def both(photons, directional=False):
    """Estimates at a grid of receivers on the floor: thinned, and of all; their places; how many records there are."""
    scene = scene_of(*plane(HALF))
    x, y = np.meshgrid(*[np.linspace(-0.9 * HALF, 0.9 * HALF, 150)] * 2)
    place = np.stack([x.ravel(), y.ravel()], axis=1).astype(np.float32)
    n = len(place)
    position = np.column_stack([place, np.full(n, 1e-3)]).astype(np.float32)
    at = Receivers(position, np.tile(UP, (n, 1)), np.full(n, 0.01, np.float32), directional=directional)
    tracer, workers = TransparencyTracer(scene, EmbreeTracer(scene)), Workers()
    gather = FinalGather(NoLight(), at, SampleBudget(16), 2 * HALF, tracer.surfaces, workers)
    density = PhotonDensity(tracer, photons, K, 1.0, workers)
    return thinned_density(density, at, gather, workers), density.at(at, workers)[0], place, len(gather.records)


def test_even_light_is_told_by_records():
    """Fewer photons than receivers: what receivers take is closer to their own estimate than that is to the truth."""
    photons = photons_at(np.random.default_rng(1).uniform(-HALF, HALF, (1000, 2)))
    thinned, full, _, n_records = both(photons)
    a, b = thinned.irradiance[:, 0], full.irradiance[:, 0]
    assert n_records < len(a) / 4 and (a != b).mean() > 0.5
    assert np.sqrt(np.mean((a - b) ** 2)) < 0.5 * b.mean() / np.sqrt(K)
    assert a.mean() == pytest.approx(b.mean(), rel=0.005)
    assert thinned.stderr.mean() == pytest.approx(full.stderr.mean(), rel=0.05)


def test_a_spot_between_records_is_not_missed():
    """Where photons are dense every receiver has an estimate of its own, though records stand farther apart."""
    random = np.random.default_rng(2)
    spot, radius = np.array([0.123, -0.345]), 0.03
    dense = spot + radius * np.sqrt(random.random((3000, 1))) * np.column_stack(
        [f(2 * np.pi * random.random(3000)) for f in (np.cos, np.sin)]
    )
    thinned, full, place, _ = both(photons_at(np.concatenate([dense, random.uniform(-HALF, HALF, (300, 2))])))
    within = np.linalg.norm(place - spot, axis=1) < 2 * radius
    assert within.sum() > 10
    assert np.array_equal(thinned.irradiance[within], full.irradiance[within])


def test_slopes_are_taken_too():
    thinned, full, *_ = both(photons_at(np.random.default_rng(3).uniform(-HALF, HALF, (1000, 2))), directional=True)
    assert thinned.slope[:, 2].mean() == pytest.approx(full.slope[:, 2].mean(), rel=0.01)
