"""Lamps as rays meet them: the light that rays find is the light that points of lamps give."""

import numpy as np
import pytest
from photon_bake.addon.core.sampling.sobol import sobol_points, sobol_seeds
from photon_bake.addon.core.sampling.warps import sample_uniform_cone
from photon_bake.addon.emitters.lamps import has_size
from photon_bake.addon.scene import LightKind, RayKind
from photon_bake.tests.core.lamp_loops import lamp_hits, lamps_along, light_samples
from photon_bake.tests.core.scenes import lamp

UP = {"position": (0.2, 0.1, 1), "direction": (0.3, 0.1, -1)}
LAMPS = {
    "disc": lamp(LightKind.POINT, 3, radius=0.3, **UP),
    "ball": lamp(LightKind.POINT, 3, radius=0.3, sphere=True, **UP),
    "spot": lamp(LightKind.SPOT, 3, radius=0.3, angle=1.2, blend=0.3, stretch=(1, 0.7), **UP),
    "spot of a ball": lamp(LightKind.SPOT, 3, radius=0.3, sphere=True, angle=0.7, blend=1.0, **UP),
    "rectangle": lamp(LightKind.RECTANGLE, 3, size=(0.5, 0.8), **UP),
    "ellipse": lamp(LightKind.ELLIPSE, 3, size=(0.5, 0.8), **UP),
    "spread": lamp(LightKind.RECTANGLE, 3, size=(0.5, 0.8), spread=2.0, **UP),
    "sun": lamp(LightKind.SUN, 3, angle=0.4, **UP),
    "far ball": lamp(LightKind.POINT, 3e6, position=(0, 0, 1000), radius=300.0, sphere=True),
}
COS_MAX = 0.5  # of a cone that has all of them


@pytest.mark.parametrize("name", LAMPS)
def test_rays_find_what_points_of_lamps_give(name):
    """∫ L cos θ dω over directions, and over points of the lamp; and the density is one over all of the lamp.

    Over 32 sequences, as one alone is off by 1.2 % where a spot's cone leaves a small part of its ball to be seen.
    """
    lights, n, n_sequences = LAMPS[name], 1 << 15, 32
    seeds = sobol_seeds(n_sequences, 0)
    light, density = np.empty((2, n_sequences, 3)), np.empty(n_sequences)
    solid_angle, zero, one = 2 * np.pi * (1 - COS_MAX), np.zeros((n, 3), np.float32), np.zeros(n, int)
    for i in range(n_sequences):
        u = np.ascontiguousarray(sobol_points(seeds, i, 0, n)[:, :2])
        light[0, i] = light_samples(lights, one, zero, zero + np.float32([0, 0, 1]), u, np.float32(10))[1].mean(axis=0)
        directions = sample_uniform_cone(u, np.float32(COS_MAX))
        hits = lamp_hits(lights, one, zero, directions)
        light[1, i] = solid_angle * (hits.radiance * directions[:, 2:]).mean(axis=0)
        met = np.isfinite(hits.distance)
        density[i] = solid_angle * np.where(met, hits.density, 0).mean()
        assert np.array_equal(met, np.isfinite(hits.density))
    (given, found), stderr = light.mean(axis=1), light[1].std(axis=0, ddof=1) / np.sqrt(n_sequences)
    assert found == pytest.approx(given, rel=0.01) and found.min() > 0.01
    assert (np.abs(found - given) < np.maximum(4 * stderr, 5e-4 * given)).all()
    assert density.mean() == pytest.approx(1, rel=0.01)


def test_from_inside_a_ball_shines_all_around():
    random = np.random.default_rng(0).normal(size=(100, 3)).astype(np.float32)
    directions = random / np.linalg.norm(random, axis=1, keepdims=True)
    lights = lamp(LightKind.SPOT, np.pi, position=(0, 0, 0.2), radius=1.0, sphere=True, angle=0.1)
    hits = lamp_hits(lights, np.zeros(100, int), np.zeros((100, 3), np.float32), directions)
    assert hits.radiance == pytest.approx(np.ones((100, 3)), rel=1e-5)
    assert np.linalg.norm(hits.distance[:, None] * directions - [0, 0, 0.2], axis=1) == pytest.approx(np.ones(100))


@pytest.mark.parametrize("kind", [LightKind.POINT, LightKind.SPOT, LightKind.SUN])
def test_lamps_without_a_size_are_not_met(kind):
    lights = lamp(kind, angle=0.5 if kind == LightKind.SPOT else 0.0)
    up = np.float32([[0, 0, 1]])
    assert not has_size(lights).any()
    assert np.isinf(lamp_hits(lights, np.zeros(1, int), 0 * up, up).distance).all()


def met(lights, distance=np.inf, kind=RayKind.GLOSSY, **more):
    up = np.float32([[0, 0, 1]])
    return lamps_along(lights, 0 * up, up, np.float32([distance]), np.array([kind]), np.zeros(1, int), **more)[0, 0]


def test_surfaces_before_lamps_and_lamps_hidden_from_rays_are_dark():
    shines = {"emission": 2, "size": (1, 1)}
    assert met(lamp(LightKind.RECTANGLE, **shines)) == 2
    assert met(lamp(LightKind.RECTANGLE, **shines), 1.1) == 2 and met(lamp(LightKind.RECTANGLE, **shines), 0.9) == 0
    assert met(lamp(LightKind.SUN, angle=0.1), 1000) == 0 < met(lamp(LightKind.SUN, angle=0.1))
    hidden = lamp(LightKind.RECTANGLE, seen_through_glass=False, **shines)
    assert met(hidden) == 2 and met(hidden, kind=RayKind.TRANSMITTED) == 0
    # A square metre one metre away: its points have the density 1/sr
    assert met(lamp(LightKind.RECTANGLE, **shines), least_density=np.float32([1.1])) == 2
    assert met(lamp(LightKind.RECTANGLE, **shines), least_density=np.float32([0.9])) == 0
