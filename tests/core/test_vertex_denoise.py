"""Noise out of vertices' light, where there is noise alone."""

import numpy as np
import pytest
from photon_bake.addon.core.errors import Cancelled
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.gather import Irradiance, OwnRays
from photon_bake.addon.output.vertex_light import denoised
from photon_bake.addon.receivers import Receivers
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import ball, box, scene_of
from scipy.spatial import cKDTree

N, SIGMA = 40, 0.05


def wall(normal=(0, 0, 1.0), height=0.0):
    """N × N receivers on a square of 1 m."""
    x, y = np.meshgrid(np.linspace(0, 1, N), np.linspace(0, 1, N))
    position = np.stack([x.ravel(), y.ravel(), np.full(x.size, height)], axis=1)
    return position.astype(np.float32), np.tile(np.array(normal, np.float32), (x.size, 1))


def light_at(
    position, normal, exact, sigma=SIGMA, gathered=None, caustics=None, seed=0, progress=None, said=None, **more
):
    """Light with noise where receivers gathered, after denoising: mean over colors, and its standard error.

    Parameters
    ----------
    more : Workers' `n_threads`; `scene`; what they took is `off` from what their own rays found.
    """
    noise = sigma * np.random.default_rng(seed).standard_normal(len(position))
    if gathered is not None:  # the others take theirs from the nearest of these
        near = cKDTree(position[gathered]).query(position[~gathered], 4)[1]
        noise[~gathered] = noise[gathered][near].mean(axis=1)
    value = np.repeat((exact + noise)[:, None], 3, axis=1).astype(np.float32)
    if caustics is not None:
        value += caustics
    own = np.ones(len(value), bool) if gathered is None else gathered
    stderr = np.full(len(value), sigma if said is None else said, np.float32)
    off = np.broadcast_to(np.asarray(more.get("off", 0), np.float32), len(value))
    rays = OwnRays(np.repeat(off[:, None], 3, axis=1), stderr, np.hypot(stderr, off))
    light = Irradiance(value - rays.off, rays.taken, {"indirect": value - rays.off}, {}, None, own, caustics, rays)
    receivers = Receivers(position, normal, np.full(len(value), 0.01, np.float32))
    tracer = EmbreeTracer(more.get("scene") or scene_of(*box(50.0)))
    workers = Workers(n_threads=more.get("n_threads", 0), progress=progress or Progress())
    found = denoised(light, receivers, np.ones(len(value), bool), 1.5, tracer, workers)
    return found.value.mean(axis=1), found.stderr


def rms(values):
    return float(np.sqrt(np.mean(np.square(values, dtype=np.float64))))


@pytest.mark.parametrize(
    "of_place", [lambda x, y: 1 + 0 * x, lambda x, y: 1 + x - y / 2, lambda x, y: 1 + (x - 0.5) ** 2]
)
def test_noise_on_a_plain_wall_falls_to_a_third_and_is_told(of_place):
    position, normal = wall()
    exact = of_place(*position.T[:2])
    found, stderr = light_at(position, normal, exact)
    assert rms(found - exact) < SIGMA / 3 and abs((found - exact).mean()) < SIGMA / 15
    assert 0.5 < rms(stderr) / rms(found - exact) < 2.5


def test_an_edge_of_light_stays():
    position, normal = wall()
    exact = np.where(position[:, 0] < 0.5, 1.0, 2.0)
    found, _ = light_at(position, normal, exact)
    beside = np.abs(position[:, 0] - 0.5) < 0.08
    assert rms((found - exact)[beside]) < 1.3 * SIGMA and rms((found - exact)[~beside]) < 0.7 * SIGMA


def test_none_changes_by_more_than_its_error_allows():
    position, normal = wall()
    exact = 1 + 0.5 * np.sin(25 * position[:, 0])
    found, _ = light_at(position, normal, exact, sigma=0.0, said=0.01)
    assert np.abs(found - exact).max() <= 2.5 * 0.01 + 1e-5


def test_without_stated_error_nothing_changes():
    position, normal = wall()
    exact = 1 + np.random.default_rng(1).random(len(position))
    found, _ = light_at(position, normal, exact, sigma=0.0)
    assert np.allclose(found, exact)


def test_walls_that_face_other_ways_have_no_part_in_each_other():
    here, there = wall(), wall((0, 0, -1.0), 0.01)
    position, normal = (np.concatenate(pair) for pair in zip(here, there, strict=True))
    exact = np.where(normal[:, 2] > 0, 1.0, 1.15)
    found, _ = light_at(position, normal, exact)
    assert abs((found - exact)[: N * N].mean()) < 0.004 and abs((found - exact)[N * N :].mean()) < 0.004


def test_caustics_stay_sharp():
    position, normal = wall()
    caustics = np.where(np.linalg.norm(position[:, :2] - 0.5, axis=1) < 0.03, 3.0, 0.0)[:, None] * np.ones(3)
    caustics = caustics.astype(np.float32)
    found, _ = light_at(position, normal, np.ones(N * N), caustics=caustics)
    assert rms(found - 1 - caustics[:, 0]) < SIGMA / 2.5


def test_receivers_that_did_not_gather_take_it_from_those_that_did():
    position, normal = wall()
    gathered = np.zeros(N * N, bool)
    gathered[::3] = True
    exact = 1 + position[:, 0]
    found, _ = light_at(position, normal, exact, gathered=gathered)
    assert rms((found - exact)[~gathered]) < SIGMA / 2


def test_light_on_a_ball_stays_round():
    vertices, _ = ball(1.0)
    normal = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    exact = 2 + normal[:, 2] ** 3
    found, _ = light_at(vertices, normal.astype(np.float32), exact)
    assert rms(found - exact) < 0.95 * SIGMA


def test_what_own_rays_know_better_is_believed():
    position, normal = wall()
    off = np.zeros(N * N)
    off[N * 20 + 20] = 0.5
    found, stderr = light_at(position, normal, np.ones(N * N), off=off)
    assert abs(found[N * 20 + 20] - 1) < 3 * SIGMA and stderr[N * 20 + 20] < 2 * SIGMA


def test_a_thin_wall_parts_light():
    """It stands on the plane at x = 0.5: noise is taken out on both sides, though light differs by less than noise."""
    position, normal = wall()
    away = np.abs(position[:, 0] - 0.5)
    exact = np.where(position[:, 0] < 0.5, 1.0, 1.08)
    thin = scene_of(np.array([[0.5, -1, -1], [0.5, 2, -1], [0.5, 2, 1], [0.5, -1, 1]]), [[0, 1, 2], [0, 2, 3]])
    errors = [
        [(light_at(position, normal, exact, scene=scene, seed=seed)[0] - exact)[away < 0.1] for seed in range(4)]
        for scene in (None, thin)
    ]
    side = np.sign(position[:, 0] - 0.5)[away < 0.1]
    leaked, parted = (float(abs((np.mean(error, axis=0) * side).mean())) for error in errors)
    assert leaked > 0.008 and parted < 0.002


def test_denoising_can_be_cancelled_and_is_the_same_for_any_threads():
    position, normal = wall()
    progress = Progress(lambda stage, fraction: progress.cancel())
    with pytest.raises(Cancelled):
        light_at(position, normal, np.ones(N * N), progress=progress)
    one, three = (light_at(position, normal, np.ones(N * N), n_threads=n)[0] for n in (1, 3))
    assert np.array_equal(one, three)
