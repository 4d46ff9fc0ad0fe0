"""Whole bakes against closed forms: furnaces, planes, corners, thin walls."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.core.errors import Cancelled
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.emitters import region_of
from photon_bake.addon.gather import FinalGather, SampleBudget
from photon_bake.addon.pipeline.bake import bake, solve
from photon_bake.addon.scene import LightKind
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import (
    box,
    lamp,
    merge,
    of_objects,
    plane,
    receivers_at,
    receivers_in_box,
    scene_of,
)

GATHERS = ["final", "density", "light_volume", "photons in a volume"]


def baked(scene, receivers, gather="final", quality="draft", **settings):
    if gather == "photons in a volume":
        gather, settings["n_volume_rays"] = "light_volume", 0
    if quality == "draft":
        settings = {"n_photons": 200_000, "n_cache_elements": 5_000, "n_grid_cells": 24, **settings}
    settings = settings_for(quality, gather=gather, max_bounces=200, **settings)
    return bake(scene, receivers, settings, EmbreeTracer(scene))


def box_with_lamp(albedo):
    return scene_of(*box(), albedo=albedo, lights=lamp(LightKind.POINT, 24 / (4 * np.pi), position=(0, 0, 0)))


@pytest.mark.parametrize("gather", GATHERS)
@pytest.mark.parametrize("albedo", [0.5, 0.8])
def test_white_furnace(albedo, gather):
    """In a closed box of 24 m² a lamp of 24 W gives a mean irradiance of 1/(1−ρ), of which ρ/(1−ρ) is indirect."""
    result = baked(box_with_lamp(albedo), receivers_in_box(500), gather, add_direct=True)
    indirect, direct = result.passes["indirect"].mean(), result.passes["direct"].mean()
    assert indirect == pytest.approx(albedo / (1 - albedo), rel=0.01 if gather == "final" else 0.02)
    assert indirect + direct == pytest.approx(1 / (1 - albedo), rel=0.02)
    assert np.array_equal(result.value, result.passes["indirect"] + result.passes["direct"])


@pytest.mark.parametrize("gather", GATHERS)
def test_furnace_whose_walls_take_light_away(gather):
    """Walls of radiance −L in it make the lamp's mean irradiance of 1 one of 1 − πL, of which ρ/(1−ρ) comes back."""
    albedo, radiance = 0.5, 0.1
    walls = scene_of(*box(), albedo=albedo, emission=-radiance)
    scene = replace(walls, lights=box_with_lamp(albedo).lights)
    result = baked(scene, receivers_in_box(500), gather, n_photons=400_000)
    assert result.value.mean() == pytest.approx((1 - np.pi * radiance) * albedo / (1 - albedo), rel=0.03)


@pytest.mark.parametrize("n_cache_rays", [0, 64])
def test_what_of_walls_lies_in_others_does_not_darken_them(n_cache_rays):
    """A furnace of six slabs that run into each other: a sixth of their inner sides is inside of others."""
    vertices, triangles = box(inwards=False)
    slabs = []
    for axis in range(3):
        for sign in (-1, 1):
            half, middle = np.full(3, 1.1), np.zeros(3)
            half[axis], middle[axis] = 0.05, sign * 1.05
            slabs.append((vertices * half + middle, triangles))
    albedo, lights = 0.8, lamp(LightKind.POINT, 24 / (4 * np.pi), position=(0, 0, 0))
    scene = of_objects(scene_of(*merge(*slabs), albedo=albedo, lights=lights), np.repeat(np.arange(6), len(triangles)))
    result = baked(scene, receivers_in_box(300), n_cache_elements=1000, n_cache_rays=n_cache_rays)
    assert result.value.mean() == pytest.approx(albedo / (1 - albedo), rel=0.015)


@pytest.mark.parametrize("albedo", [0.5, 0.8])
@pytest.mark.parametrize("n_cache_rays", [0, 64])
def test_furnace_of_glowing_walls_is_even(albedo, n_cache_rays):
    """Walls of radiance L make E = πL/(1−ρ) everywhere, πLρ/(1−ρ) of it indirect: at every point, not in the mean."""
    scene = scene_of(*box(), albedo=albedo, emission=1.0)
    settings = {"n_gather_rays": 256, "n_cache_rays": n_cache_rays, "n_photons": 400_000}
    result = baked(scene, receivers_in_box(100), **settings)
    expected = np.pi * albedo / (1 - albedo)
    assert result.value.mean() == pytest.approx(expected, rel=0.01)
    assert np.abs(result.value / expected - 1).max() < 0.15


def test_world_lights_a_plane_and_the_plane_what_is_above():
    """A wide plane under a world of radiance L receives πL; a receiver above that looks down gets ρπL from it."""
    scene = scene_of(*plane(100.0), albedo=0.6, world=2.0)
    result = baked(scene, receivers_at([(0, 0, 0.5)], (0, 0, -1)), n_gather_rays=256)
    assert result.value[0] == pytest.approx(np.full(3, 0.6 * np.pi * 2), rel=0.02)
    up = baked(scene, receivers_at([(0, 0, 1e-3)], (0, 0, 1)), add_direct=True)
    assert up.passes["direct"][0] == pytest.approx(np.full(3, np.pi * 2), rel=1e-3)
    assert up.passes["indirect"].max() == 0


@pytest.mark.parametrize("size", [0.01, 1.0, 100.0])
def test_light_scales_with_the_square_of_the_size(size):
    scene = scene_of(*box(size), lights=lamp(LightKind.POINT, 24 / (4 * np.pi), position=(0, 0, 0)))
    result = baked(scene, receivers_in_box(50, half=size, lift=1e-3 * size))
    assert result.value.mean() == pytest.approx(1 / size**2, rel=0.02)


@pytest.mark.parametrize("gather", GATHERS)
def test_corners_are_neither_black_nor_leaking(gather):
    """Two boxes stand a tenth of a millimetre apart; only the left one is lit. Receivers lie 1 % from the edges."""
    left, right = box(), box()
    mesh = merge((left[0] - [1, 0, 0], left[1]), (right[0] + [1.0001, 0, 0], right[1]))
    scene = scene_of(*mesh, lights=lamp(LightKind.POINT, 24 / (4 * np.pi), position=(-1, 0, 0)))
    corners = [(-0.02, y, -0.999) for y in (-0.98, 0, 0.98)] + [(-1.98, -0.98, -0.999)]
    lit = baked(scene, receivers_at(corners, (0, 0, 1)), gather, "medium")
    dark = baked(scene, receivers_at(np.array(corners) * [-1, 1, 1], (0, 0, 1)), gather)
    assert lit.value.min() > 0.5 and lit.value.max() < 1.5  # the furnace's mean is 1
    assert dark.value.max() == 0


def test_dark_cavity_stays_dark():
    """A low cupboard stands on a lit floor, itself of two triangles: under it no light comes in."""
    cupboard, room = box(0.2), box()
    mesh = merge(room, (cupboard[0] - [0, 0, 0.8], cupboard[1]))
    scene = scene_of(*mesh, lights=lamp(LightKind.POINT, 24 / (4 * np.pi), position=(0, 0, 0.5)))
    result = baked(scene, receivers_at([(0, 0, -0.999), (0.19, 0.19, -0.999)], (0, 0, 1)), n_gather_rays=256)
    assert result.value.max() < 0.01


def test_gathers_agree_on_colour():
    walls = [0, 1, 0, 0, 0, 0] * 2
    scene = scene_of(
        *box(),
        albedo=[[0.7, 0.7, 0.7], [0.6, 0.1, 0.1]],
        material=walls,
        lights=lamp(LightKind.RECTANGLE, 3.0, (0, 0, 0.99), size=(0.5, 0.5)),
    )
    at = receivers_in_box(50)
    best = baked(scene, at, n_gather_rays=256, n_cache_rays=4).value.mean(0)
    for gather in GATHERS:
        assert baked(scene, at, gather).value.mean(0) == pytest.approx(best, rel=0.03), gather


@pytest.mark.parametrize("gather", GATHERS)
def test_same_seed_same_light_whatever_the_threads(gather):
    scene, at = box_with_lamp(0.5), receivers_in_box(300)
    one, three = (baked(scene, at, gather, n_threads=n, add_direct=True, noise=0.08) for n in (1, 3))
    assert np.array_equal(one.value, three.value) and np.array_equal(one.stderr, three.stderr)
    assert not np.array_equal(one.value, baked(scene, at, gather, seed=1, add_direct=True, noise=0.08).value)


def test_noise_is_what_the_bake_says_it_is():
    """The scatter of gathers that differ in their rays alone is what they estimate, and reaches what was asked."""
    scene, at = box_with_lamp(0.5), receivers_in_box(100)
    solution = solve(scene, at, settings_for("draft", n_photons=200_000), EmbreeTracer(scene))
    extent, tracer = 2 * region_of(at.position).radius, solution.tracer.surfaces
    runs = [
        FinalGather(solution.rays, at, SampleBudget(64), extent, tracer, Workers(seed)).finish().light
        for seed in range(8)
    ]
    scatter = np.sqrt(np.stack([run.irradiance.mean(1) for run in runs]).var(axis=0, ddof=1).mean())
    said = np.sqrt(np.mean([run.stderr**2 for run in runs]))
    assert 0.9 < scatter / said < 1.1
    given = solution.irradiance()
    asked = baked(scene, at, n_gather_rays=64, noise=0.01)
    assert asked.relative_noise <= 0.01 < given.relative_noise
    assert asked.counts["gather_rays"] > given.counts["gather_rays"]


def test_more_photons_converge():
    """Without a gather of the cache's own, noise falls with the number of photons: the estimate is consistent."""
    scene, at = box_with_lamp(0.8), receivers_in_box(100)
    errors = []
    for n in (1_000, 64_000):
        runs = [
            baked(scene, at, "density", n_photons=n, n_nearest=max(20, n // 200), seed=seed).value.mean()
            for seed in range(8)
        ]
        errors.append(np.sqrt(np.mean((np.array(runs) - 4) ** 2)))
    assert errors[1] < errors[0] / 3 and errors[1] < 0.05


def test_hidden_objects_receive_and_hide_nothing():
    """A plane that rays do not see lies across the box: receivers on it get light, and the box is lit as without it."""
    mesh = merge(box(), plane(1.0))
    lights = lamp(LightKind.POINT, 24 / (4 * np.pi), position=(0, 0, 0.3))
    at = receivers_at([(0, 0, -0.999), (0.3, 0.2, 1e-3)], (0, 0, 1))
    hidden = baked(scene_of(*mesh, lights=lights, hidden=(12, 13)), at, n_gather_rays=2048).value
    without = baked(scene_of(*box(), lights=lights), at, n_gather_rays=2048).value
    assert hidden == pytest.approx(without, rel=0.1)
    blocked = baked(scene_of(*mesh, lights=lights), at, n_gather_rays=2048).value
    assert blocked[0].max() < 0.01


@pytest.mark.parametrize("gather", GATHERS)
def test_odd_inputs_give_finite_light(gather):
    dark = scene_of(*box(), albedo=0.0, lights=lamp(LightKind.POINT, 1.0, position=(0, 0, 0)))
    assert not baked(dark, receivers_in_box(10), gather).value.any()
    outside = baked(box_with_lamp(0.5), receivers_at([(5, 5, 5)], (0, 0, 1)), gather)
    assert not outside.value.any()
    nothing = baked(box_with_lamp(0.5), receivers_at(np.zeros((0, 3)), (0, 0, 1)), gather)
    assert nothing.value.shape == (0, 3) and nothing.relative_noise == 0
    no_mesh = scene_of(np.zeros((0, 3)), [], lights=lamp(LightKind.POINT))
    assert not baked(no_mesh, receivers_at([(0, 0, 0)], (0, 0, 1)), gather).value.any()


@pytest.mark.parametrize("gather", GATHERS)
def test_where_nothing_gives_light_the_light_is_black(gather):
    assert not baked(scene_of(*box()), receivers_in_box(10), gather).value.any()


class CancelsAt(Progress):
    """Is cancelled once a stage has begun."""

    def __init__(self, stage):
        super().__init__(lambda at, _: self.cancel() if at == stage else None)


@pytest.mark.parametrize("changes", [{}, {"gather": "light_volume"}, {"gather": "light_volume", "n_volume_rays": 0}])
def test_cancel_at_every_stage(changes):
    """Whatever stage a cancel meets, the bake ends with `Cancelled`."""
    scene, at = box_with_lamp(0.5), receivers_in_box(10)
    stages: list[str] = []
    settings = settings_for("draft", n_photons=10_000, n_cache_elements=1_000, n_grid_cells=8, **changes)
    bake(scene, at, settings, EmbreeTracer(scene), Progress(lambda stage, _: stages.append(stage)))
    for stage in dict.fromkeys(stages):
        progress = CancelsAt(stage)
        with pytest.raises(Cancelled):
            bake(scene, at, settings, EmbreeTracer(scene), progress)
            progress.update("Done", 1.0)
    assert len(set(stages)) >= 4


@pytest.mark.parametrize(
    "changes",
    [
        {"gather": "final"},
        {"gather": "final", "noise": 0.01},
        {"gather": "density"},
        {"gather": "light_volume"},
        {"gather": "light_volume", "n_volume_rays": 0},
    ],
)
def test_progress_never_goes_back_within_a_stage(changes):
    said: dict[str, list[float]] = {}
    scene = box_with_lamp(0.5)
    progress = Progress(lambda stage, fraction: said.setdefault(stage, []).append(fraction))
    bake(scene, receivers_in_box(100), settings_for("draft", add_direct=True, **changes), EmbreeTracer(scene), progress)
    for stage, fractions in said.items():
        assert fractions == sorted(fractions) and fractions[0] >= 0 and fractions[-1] <= 1, stage
    assert set(progress.stage_seconds) == set(said)


def test_a_solution_gathers_at_other_receivers():
    """Of those it was solved for it is the same light, and half of them have it too; the progress hears nothing."""
    scene, at, told = box_with_lamp(0.5), receivers_in_box(200), []
    settings = settings_for("draft", n_photons=50_000, n_cache_elements=2_000, interpolate=False)
    progress = Progress(lambda stage, fraction: told.append(stage))
    solution = solve(scene, at, settings, EmbreeTracer(scene), progress)
    light, n_told = solution.irradiance(), len(told)
    assert np.array_equal(solution.gather(at).value, light.value) and len(told) == n_told
    assert solution.gather(at.where(np.arange(100))).value.mean() == pytest.approx(light.value[:100].mean(), rel=0.03)
    progress.cancel()
    with pytest.raises(Cancelled):
        solution.gather(at)
