"""The mean light of several times, receivers that ride on surfaces, and what each step of a shutter gets."""

import numpy as np
import pytest
from photon_bake.addon.gather import Irradiance, OwnRays
from photon_bake.addon.output.camera import CameraPass
from photon_bake.addon.receivers import Riding
from photon_bake.addon.settings.bake import BakeSettings, part_of_shutter
from photon_bake.addon.tracing import EmbreeTracer
from photon_bake.tests.core.scenes import ball, receivers_at, scene_of


def light_of(value, stderr=1.0, gathered=(True, True), photons=100):
    value = np.full((2, 3), value, np.float32)
    stderr = np.full(2, stderr, np.float32)
    own = OwnRays(value / 10, 2 * stderr, stderr)
    counts = {"receivers": 2, "stored_photons": photons, "gather_points": 2}
    return Irradiance(value, stderr, {"indirect": value}, counts, None, np.array(gathered), value / 2, own)


def test_mean_light_and_its_error():
    mean = Irradiance.mean([light_of(1.0, 3.0), light_of(5.0, 4.0, photons=50)])
    np.testing.assert_allclose(mean.value, 3)
    np.testing.assert_allclose(mean.passes["indirect"], 3)
    np.testing.assert_allclose(mean.caustics, 1.5)
    np.testing.assert_allclose(mean.stderr, 2.5)  # √(3² + 4²) / 2
    np.testing.assert_allclose(mean.own_rays.off, 0.3)
    np.testing.assert_allclose(mean.own_rays.stderr, 5)
    assert mean.counts == {"receivers": 2, "stored_photons": 150, "gather_points": 2}
    one = light_of(1.0)
    assert Irradiance.mean([one]) is one


def test_receivers_that_gathered_at_some_times_alone_count_as_not():
    mean = Irradiance.mean([light_of(1.0, gathered=(True, False)), light_of(1.0, gathered=(False, True))])
    assert not mean.gathered.any() and mean.own_rays is None


def test_mean_pass_keeps_radiance():
    """A white surface that is gone at the second time, and grey light: products are averaged, not factors."""

    def a_pass(albedo, light, error):
        ones = np.ones((1, 2, 3), np.float32)
        return CameraPass(light * ones, 0.1 * ones, 0.2 * ones, albedo * ones, ones, ones[..., 0], error * ones[..., 0])

    parts = [a_pass(0.8, 2.0, 3.0), a_pass(0.0, 7.0, 4.0)]
    mean = CameraPass.mean(parts)
    np.testing.assert_allclose(mean.indirect, np.mean([one.indirect for one in parts], axis=0), rtol=1e-6)
    np.testing.assert_allclose(mean.indirect_diffuse, 2.0, rtol=1e-6)
    np.testing.assert_allclose(mean.error, 2.5, rtol=1e-6)


def riding_on_ball():
    scene = scene_of(*ball(1.0))
    k = np.arange(0, scene.n_triangles, 7)
    third = np.full(len(k), 1 / 3, np.float32)
    normal = scene.normals[k]
    receivers = receivers_at(scene.points(k, third, third) + np.float32(1e-3) * normal, normal)
    return scene, receivers, Riding.of(receivers, scene, EmbreeTracer(scene))


@pytest.mark.parametrize("angle", [0.0, 0.7, 3.0])
def test_receivers_turn_and_move_with_their_surface(angle):
    scene, receivers, riding = riding_on_ball()
    assert len(riding.rider) == len(receivers)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    offset = np.array([3.0, -2, 1])
    vertices, normals = (scene.vertices @ turn.T + offset).astype(np.float32), scene.corner_normals @ turn.T
    ride = riding.on(vertices, normals.astype(np.float32))
    np.testing.assert_allclose(ride.receivers.position, receivers.position @ turn.T + offset, atol=2e-6)
    np.testing.assert_allclose(ride.receivers.normal, receivers.normal @ turn.T, atol=2e-5)
    # Light that does not turn, of slope G over normals in the world: at rest G applies to turned normals
    slope = np.random.default_rng(1).normal(size=(1, 3, 3)).astype(np.float32).repeat(len(receivers), 0)
    at_rest, small = ride.at_rest(slope), np.array([0.01, 0.02, -0.01])
    expected = np.einsum("nij,i->nj", slope, turn @ small)
    np.testing.assert_allclose(np.einsum("nij,i->nj", at_rest, small), expected, atol=1e-5)


def test_receivers_stay_on_a_surface_that_grows():
    """They keep their height over it, and their normal along that of the surface."""
    scene, receivers, riding = riding_on_ball()
    ride = riding.on(2 * scene.vertices, scene.corner_normals)
    on_surface = 2 * (receivers.position - np.float32(1e-3) * receivers.normal)
    np.testing.assert_allclose(ride.receivers.position, on_surface + np.float32(1e-3) * receivers.normal, atol=1e-5)


def test_receivers_of_no_surface_stand_still():
    scene, receivers, _ = riding_on_ball()
    far = receivers_at(receivers.position + np.float32(5), receivers.normal)
    riding = Riding.of(far, scene, EmbreeTracer(scene))
    ride = riding.on(scene.vertices + np.float32(1), scene.corner_normals)
    np.testing.assert_array_equal(ride.receivers.position, far.position)


def test_steps_share_the_work_and_have_random_numbers_of_their_own():
    settings = BakeSettings(motion_blur=8, n_photons=1_000_000, n_gather_rays=1250, time=16, noise=0.01, seed=5)
    steps = [part_of_shutter(settings, i) for i in range(8)]
    assert len({one.seed for one in steps}) == 8 and steps[0].seed == 5
    assert steps[0].n_photons == 125_000 and steps[0].n_gather_rays == 157 and steps[0].time == 2
    assert steps[0].noise == pytest.approx(0.01 * 8**0.5)
    assert part_of_shutter(BakeSettings(motion_blur=256, n_photons=1000, n_cache_rays=0), 3).n_photons == 1000
    assert part_of_shutter(BakeSettings(motion_blur=4, n_cache_rays=0), 3).n_cache_rays == 0
    of_rays = [part_of_shutter(BakeSettings(motion_blur=8, n_gather_rays=n), 0).n_gather_rays for n in (32, 256, 1024)]
    assert of_rays == [32, 64, 128]
