"""Photons that come home to where light is wanted bring the light that all others would."""

import numpy as np
import pytest
from photon_bake.addon.bsdf import Lobe
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.sampling.warps import sample_cosine_hemisphere
from photon_bake.addon.emitters import Sphere, light_sources
from photon_bake.addon.photons import trace_photons
from photon_bake.addon.photons.region_directed import sent_home
from photon_bake.addon.photons.scattering import Scattered
from photon_bake.addon.scene import LightKind
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import lamp, merge, plane, scene_of

N = 1 << 18
UP = np.array([0, 0, 1], np.float32)


def scattered_at(place, n=N):
    """Cosine-weighted directions of n photons from one place on a ground."""
    random = np.random.default_rng(4)
    directions = sample_cosine_hemisphere(random.random((n, 2), dtype=np.float32))
    positions, normals = np.tile(np.asarray(place, np.float32), (n, 1)), np.tile(UP, (n, 1))
    lobes = np.full(n, Lobe.DIFFUSE, np.uint8)
    scattered = Scattered(positions, directions, np.ones((n, 3), np.float32), lobes, np.zeros(n, bool))
    return scattered, positions, normals, random


@pytest.mark.parametrize("distance", [1.2, 3.0, 30.0])
def test_light_keeps_its_way(distance):
    """By the cosine law: the weights' means over parts of the sky are its integrals, here and there."""
    scattered, positions, normals, random = scattered_at((distance, 0, -0.2))
    sent, ratio = sent_home(scattered, positions, normals, Sphere(np.zeros(3, np.float32), 1.0), random)
    z, side = sent.directions[:, 2], sent.directions[:, 0] < 0
    ratio = ratio.astype(np.float64)
    assert ratio.max() <= 2.0001
    assert ratio.mean() == pytest.approx(1, abs=5 * ratio.std() / N**0.5)
    for low, high in ((0, 0.05), (0.05, 0.3), (0.3, 0.8), (0.8, 1)):
        for facing in (side, ~side):
            share = ratio * ((z > low) & (z <= high) & facing)
            mean = (high**2 - low**2) / 2  # of cos θ/π over half of the ring
            assert share.mean() == pytest.approx(mean, abs=5 * share.std() / N**0.5 + 1e-5)


def test_half_come_home_with_what_they_would_carry_together():
    """A ball of radius 1 at distance 30: half of the photons fly to it, with the light of a two-thousandth of them."""
    scattered, positions, normals, random = scattered_at((30, 0, -10))
    sent, ratio = sent_home(scattered, positions, normals, Sphere(np.zeros(3, np.float32), 1.0), random)
    to_centre = -positions[0] / np.linalg.norm(positions[0])
    home = sent.directions @ to_centre > np.cos(np.arcsin(1 / np.linalg.norm(positions[0])))
    assert home.mean() == pytest.approx(0.5, abs=0.01)
    sine2 = 1 / np.dot(positions[0], positions[0])
    assert (ratio * home).mean() == pytest.approx(sine2 * to_centre[2], rel=0.02)  # projected solid angle over π
    assert (ratio[home] < 0.01).all()


def test_mirrors_and_the_region_s_own_photons_are_left_alone():
    scattered, positions, normals, random = scattered_at((0.5, 0, 0), n=1000)
    for region in (Sphere(np.zeros(3, np.float32), 1.0), Sphere(np.full(3, 9, np.float32), 0.0)):
        sent, ratio = sent_home(scattered, positions, normals, region, random)
        assert (ratio == 1).all()
        np.testing.assert_array_equal(sent.directions, scattered.directions)


def test_ground_lights_a_wall_without_bright_spots():
    """A sunlit ground with the albedo ρ, 200 m wide, gives a small upright square in its middle E = ½ρE₀, nearly."""
    ground, (square, triangles) = plane(100.0), plane(0.5)
    upright = square[:, [2, 0, 1]] + np.array([0, 0, 1], np.float32)
    scene = scene_of(*merge(ground, (upright, triangles)), lights=lamp(LightKind.SUN, 2.0))
    tracer = TransparencyTracer(scene, EmbreeTracer(scene))
    region = Sphere(np.array([0, 0, 1], np.float32), 1.0)
    sources = light_sources(scene, region)
    powers = []
    for wanted in (None, region):
        photons = trace_photons(scene, tracer, sources, N, 2, Workers(), region=wanted)
        on = photons.power.astype(float)[:, 0][(photons.triangle >= 2) & (photons.bounce == 1)]
        powers.append(on)
        assert on.sum() == pytest.approx(2 * 0.5 * 0.5 * 2.0, rel=5 * np.sqrt((on**2).sum()) / on.sum() + 0.02)
    plain, home = powers
    assert len(home) > 5 * len(plain)
    assert (home**2).sum() < 0.2 * (plain**2).sum()
    assert home.max() < 0.2 * plain.max()
