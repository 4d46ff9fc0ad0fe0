"""Photons directed to where light is wanted bring the light that all others would."""

import numpy as np
import pytest
from photon_bake.addon.core.compiling import kernel
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.sampling.warps import sample_cosine_hemisphere
from photon_bake.addon.core.vec3 import put, row
from photon_bake.addon.emitters import Sphere, light_sources
from photon_bake.addon.photons import trace_photons
from photon_bake.addon.photons.region_directed import MOST_GAIN, TargetRegion, directed, is_directed, target_region
from photon_bake.addon.scene import LightKind
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import lamp, merge, plane, scene_of

N = 1 << 18
UNIT = target_region(Sphere(np.zeros(3, np.float32), 1.0))


@kernel
def _directed_all(region, position, gained, directions, u, ratio):
    for k in range(len(directions)):
        up = (np.float32(0), np.float32(0), np.float32(1))
        at, onward = row(position, 0), row(directions, k)
        ratio[k] = 1
        if is_directed(region, gained[k], at):
            onward, ratio[k] = directed(region, at, up, onward, u[k, 0], u[k, 1], u[k, 2])
            put(directions, k, onward)


def sent_from(place, region: TargetRegion = UNIT, n=N, gained=1.0):
    """Directions of photons from a place of level ground, some of them directed; their factors; directions before."""
    u = np.random.default_rng(4).random((n, 5), dtype=np.float32)
    before = sample_cosine_hemisphere(np.ascontiguousarray(u[:, 3:]))
    directions, ratio = before.copy(), np.empty(n, np.float32)
    gained = np.broadcast_to(np.float32(gained), n).copy()
    _directed_all(region, np.array([place], np.float32), gained, directions, np.ascontiguousarray(u[:, :3]), ratio)
    return directions, ratio.astype(np.float64), before


@pytest.mark.parametrize("distance", [1.2, 3.0, 30.0])
def test_light_keeps_its_way(distance):
    """By the cosine law: the weights' means over parts of the sky are its integrals, here and there."""
    directions, ratio, _ = sent_from((distance, 0, -0.2))
    z, side = directions[:, 2], directions[:, 0] < 0
    assert ratio.max() <= 2.0001
    assert ratio.mean() == pytest.approx(1, abs=5 * ratio.std() / N**0.5)
    for low, high in ((0, 0.05), (0.05, 0.3), (0.3, 0.8), (0.8, 1)):
        for facing in (side, ~side):
            share = ratio * ((z > low) & (z <= high) & facing)
            mean = (high**2 - low**2) / 2  # of cos θ/π over half of the ring
            assert share.mean() == pytest.approx(mean, abs=5 * share.std() / N**0.5 + 1e-5)


def test_half_fly_to_the_region_with_what_they_would_carry_together():
    """A ball of radius 1 at distance 30: half of the photons fly to it, with the light of a two-thousandth of them."""
    place = np.float32([30, 0, -10])
    directions, ratio, _ = sent_from(place)
    distance = np.linalg.norm(place)
    to_centre = -place / distance
    there = directions @ to_centre > np.cos(np.arcsin(1 / distance))
    assert there.mean() == pytest.approx(0.5, abs=0.01)
    assert (ratio * there).mean() == pytest.approx(to_centre[2] / distance**2, rel=0.02)  # projected solid angle over π
    assert (ratio[there] < 0.01).all()


def test_photons_near_the_region_and_those_without_one_are_left_alone():
    for place, region in (((1.9, 0, 0), UNIT), ((9, 9, 9), target_region(None))):
        directions, ratio, before = sent_from(place, region, n=1000)
        assert (ratio == 1).all()
        np.testing.assert_array_equal(directions, before)


def test_photons_that_stay_away_do_not_gain_without_bound():
    gained = np.where(np.arange(1000) < 500, MOST_GAIN, np.float32(1))
    directions, ratio, before = sent_from((30, 0, -10), n=1000, gained=gained)
    assert (ratio[:500] == 1).all() and np.array_equal(directions[:500], before[:500])
    assert (ratio[500:] != 1).all()


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
    plain, better = powers
    assert len(better) > 5 * len(plain)
    assert (better**2).sum() < 0.2 * (plain**2).sum()
    assert better.max() < 0.2 * plain.max()
