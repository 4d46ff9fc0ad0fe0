"""Light inside a sphere, where every bounce of light I/r² is even and a share ρ of the one before (closed form)."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.pipeline.bake import bake
from photon_bake.addon.scene import LightKind, Lights, World
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import ball, lamp, of_objects, receivers_at, scene_of

RHO, DIRECT = 0.6, 2.0  # albedo; W/m² of a lamp in the middle
ALL = RHO / (1 - RHO)


def indirect(lamps, emission=0.0, world=0.0, **settings):
    """Mean indirect irradiance inside a sphere of radius 1 with lamps of given W/m² and Max Bounces in its middle."""
    lights = Lights.join([lamp(LightKind.POINT, w, position=(0, 0, 0)) for w, _ in lamps] or [Lights.none()])
    lights = replace(lights, max_bounces=np.array([n for _, n in lamps], np.int32))
    scene = scene_of(*ball(1.0, n=32), albedo=RHO, emission=emission, lights=lights)
    scene = replace(of_objects(scene, np.zeros(scene.n_triangles)), world=World.constant(world))
    normals = np.random.default_rng(2).normal(size=(60, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    given = {"n_photons": 60_000, "n_gather_rays": 64, "n_cache_elements": 4000} | settings
    settings = settings_for("draft", max_bounces=200, **given)
    return bake(scene, receivers_at(0.98 * normals, -normals), settings, EmbreeTracer(scene)).value.mean()


@pytest.mark.parametrize("max_bounces, bounces", [(0, 0), (1, RHO), (2, RHO + RHO**2), (1024, ALL)])
@pytest.mark.parametrize("n_cache_rays", [0, 4])
def test_a_lamp_s_own_max_bounces(max_bounces, bounces, n_cache_rays):
    """Light counts if at most so many surfaces lie between the lamp and the receiver."""
    got = indirect([(DIRECT, max_bounces)], n_cache_rays=n_cache_rays)
    assert got == pytest.approx(DIRECT * bounces, rel=0.03, abs=1e-6)


def test_other_lamps_keep_their_bounces():
    got = indirect([(DIRECT, 1), (3 * DIRECT, 1024)], n_cache_rays=4)
    assert got == pytest.approx(DIRECT * (RHO + 3 * ALL), rel=0.03)


@pytest.mark.parametrize("max_bounces, bounces", [(0, 0), (1, RHO)])
def test_max_bounces_of_a_density_estimate(max_bounces, bounces):
    got = indirect([(DIRECT, max_bounces)], gather="density")
    assert got == pytest.approx(DIRECT * bounces, rel=0.04, abs=1e-6)


@pytest.mark.parametrize("gather", ["final", "density"])
def test_lamps_with_negative_power_take_light_away(gather):
    got = indirect([(DIRECT, 1024), (-0.4 * DIRECT, 1024)], gather=gather)
    assert got == pytest.approx(0.6 * DIRECT * ALL, rel=0.04)


def test_surfaces_with_negative_emission_take_light_away():
    got = indirect([(DIRECT, 1024)], emission=-0.3 * DIRECT / np.pi)
    assert got == pytest.approx(0.7 * DIRECT * ALL, rel=0.04)


def test_a_lamp_that_takes_more_than_there_is_leaves_less_than_nothing():
    assert indirect([(-DIRECT, 1024)]) == pytest.approx(-DIRECT * ALL, rel=0.04)
