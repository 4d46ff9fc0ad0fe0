"""Light probes: where they lie, and their light against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.sampling.spherical_harmonics import (
    Y0,
    Y1,
    sh_basis,
    sh_cosine_lobe,
    turned_harmonics,
)
from photon_bake.addon.gather.rays.probe_light import N_SH, SIDES, caustics_at_probes, sphere_directions
from photon_bake.addon.photons import Flights
from photon_bake.addon.pipeline.bake import bake, solve
from photon_bake.addon.pipeline.probe_bake import probe_light
from photon_bake.addon.receivers import ProbePlaces, grid_in_box, without_surroundings
from photon_bake.addon.scene import LightKind, World
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, lamp, merge, plane, receivers_at, scene_of
from photon_bake.tests.core.test_light_volume import sphere_rule

QUICK = {"n_photons": 20_000, "n_cache_elements": 2_000, "n_cache_rays": 0}


def places(*positions):
    points = np.array(positions, np.float32)
    return ProbePlaces((), tuple(str(i) for i in range(len(points))), points)


def light_at(scene, at, n_rays=1024, **changes):
    settings, tracer = settings_for("medium", **{**QUICK, **changes}), EmbreeTracer(scene)
    solution = solve(scene, at.eyes(), settings, tracer).at(receivers_at(np.zeros((0, 3)), (0, 0, 1)))
    return probe_light(solution, at.positions, n_rays, Workers(settings.seed, settings.n_threads))


def floor_below(**more):
    """A floor that reflects nothing, far below."""
    return scene_of(*plane(1.0, -50.0), albedo=0.0, **more)


def test_third_band_is_orthonormal_and_its_cosine_lobe_an_integral():
    directions, weights = sphere_rule(200)
    y = sh_basis(directions, 3)
    assert np.einsum("n,na,nb->ab", weights, y, y) == pytest.approx(np.eye(9), abs=1e-5)
    normal = np.array([[2 / 3, -1 / 3, 2 / 3]])
    lobe = np.einsum("n,na->a", weights * np.maximum(directions @ normal[0], 0), y)
    assert sh_cosine_lobe(normal, 3)[0] == pytest.approx(lobe, abs=1e-3)


def test_harmonics_turn_with_what_they_are_of():
    rotation = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], float)
    coefficients = np.random.default_rng(2).standard_normal(9)
    directions = sphere_directions(1, 50, np.random.default_rng(1))
    turned = sh_basis(directions @ rotation.T, 3) @ turned_harmonics(rotation, 3) @ coefficients
    assert turned == pytest.approx(sh_basis(directions, 3) @ coefficients, abs=1e-5)


def test_a_world_of_one_radiance():
    """L everywhere: c₀ = L √(4π) and no other coefficient; E = π L on all sides, which the harmonics say too."""
    light = light_at(floor_below(world=0.7), places((0, 0, 0), (0.3, 0.2, 0.1)), add_direct=True)
    assert light.sh[:, 0] == pytest.approx(np.full((2, 3), 0.7 * np.sqrt(4 * np.pi)), rel=1e-3)
    assert np.abs(light.sh[:, 1:]).max() < 0.02
    assert light.irradiance == pytest.approx(np.full((2, 6, 3), 0.7 * np.pi), rel=5e-3)
    by_harmonics = np.einsum("sk,pkc->psc", sh_cosine_lobe(SIDES, 3), light.sh)
    assert by_harmonics == pytest.approx(light.irradiance, rel=1e-2)
    assert not light.inside.any()


def test_direct_light_is_asked_for():
    light = light_at(floor_below(world=0.7), places((0, 0, 0)))
    assert not light.sh.any() and not light.irradiance.any()


def test_one_distant_lamp():
    """E⊥ from ω: c = E⊥ y(ω) and E(a) = E⊥ (ω·a)⁺, exactly."""
    toward = np.array([0.48, -0.6, 0.64])
    sun = lamp(LightKind.SUN, 5.0, direction=-toward)
    light = light_at(floor_below(lights=sun), places((0, 0, 0)), add_direct=True)
    assert light.sh[0, :, 0] == pytest.approx(5 * sh_basis(toward[None], 3)[0], rel=1e-3, abs=1e-3)
    assert light.irradiance[0, :, 1] == pytest.approx(5 * np.maximum(SIDES @ toward, 0), rel=1e-3, abs=1e-3)
    assert light.stderr.max() < 1e-3


def test_half_a_sky():
    """A lamp as wide as half the sky: c₀ = 2π Y₀ L, c_z = π Y₁ L, and no other of two bands; of the third none."""
    scene = scene_of(*plane(500.0, 1.0), albedo=0.0, emission=1.0)
    light = light_at(scene, places((0, 0, 0)), add_direct=True)
    expected = np.zeros(9)
    expected[0], expected[3] = 2 * np.pi * Y0, np.pi * Y1
    assert np.abs(light.sh[0, :, 0] - expected).max() < 0.05
    assert (np.abs(light.sh[0, :, 0] - expected) < 5 * light.stderr[0, :9] + 5e-3).all()
    assert light.irradiance[0, 4:, 0] == pytest.approx([np.pi, 0], abs=0.03)  # up, down


def test_a_furnace():
    """Walls of albedo ρ that are lit alike by themselves: L = ρ/(1 − ρ) of what they emit, from everywhere."""
    scene = scene_of(*box(1.0), albedo=0.5, emission=2.0)
    light = light_at(scene, places((0, 0, 0), (0.5, -0.6, 0.7)), n_photons=400_000)
    assert light.sh[:, 0] == pytest.approx(np.full((2, 3), 2 * np.sqrt(4 * np.pi)), rel=0.02)
    assert np.abs(light.sh[:, 1:]).max() < 0.25
    assert light.irradiance == pytest.approx(np.full((2, 6, 3), 2 * np.pi), rel=0.03)


def lit_room():
    """A room with a grey block in it, lit by a lamp."""
    block = box(0.3, inwards=False)
    vertices, triangles = merge(box(1.0), (block[0] + np.float32([0.4, 0.3, -0.7]), block[1]))
    albedo = [(0.6, 0.3, 0.2), (0.5, 0.5, 0.5)]
    material = np.repeat([0, 1], 12)
    light = lamp(LightKind.POINT, 3.0, position=(-0.5, -0.2, 0.6))
    return scene_of(vertices, triangles, albedo=albedo, material=material, lights=light)


@pytest.mark.parametrize("add_direct", [False, True])
def test_sides_have_the_light_of_receivers_there(add_direct):
    """Six receivers in the same place, by the final gather, agree within the errors that both say."""
    at, settings = places((-0.1, 0.2, 0.1)), settings_for("medium", add_direct=add_direct, **QUICK)
    scene = lit_room()
    light = light_at(scene, at, 4096, add_direct=add_direct)
    around = receivers_at(np.repeat(at.positions, 6, 0), (0, 0, 1))
    around.normal[:] = SIDES
    receivers = bake(
        scene,
        around,
        settings_for("medium", **{**QUICK, "add_direct": add_direct, "n_gather_rays": 4096}),
        EmbreeTracer(scene),
    )
    error = np.hypot(receivers.stderr, light.stderr[0, N_SH:])
    assert (
        np.abs(light.irradiance[0] - receivers.value).mean(axis=1) < 4 * error + 0.01 * receivers.value.mean()
    ).all()
    by_harmonics = sh_cosine_lobe(SIDES, 3) @ light.sh[0]
    assert np.abs(by_harmonics - receivers.value).mean() < 0.1 * receivers.value.mean()
    assert settings.add_direct == add_direct


def test_errors_are_those_that_seeds_show():
    seeds = [light_at(lit_room(), places((0, 0, 0.2)), 256, seed=seed) for seed in range(12)]
    means = np.array([np.concatenate([one.sh[0], one.irradiance[0]]).mean(axis=1) for one in seeds])
    said = np.sqrt(np.mean([one.stderr[0] ** 2 for one in seeds], axis=0))
    ratio = np.sqrt(np.mean((means.std(axis=0, ddof=1) / said) ** 2))
    assert 0.4 < ratio < 2


def test_same_light_whatever_the_threads():
    one, two = (light_at(lit_room(), places((0, 0, 0.2), (0.2, 0, 0)), 64, n_threads=n) for n in (1, 2))
    assert np.array_equal(one.sh, two.sh) and np.array_equal(one.stderr, two.stderr)


def test_inside_of_solids():
    """In the block is no light; a room whose walls face out is none, as light is in it."""
    light = light_at(lit_room(), places((0.4, 0.3, -0.7), (-0.4, 0, 0)), 64)
    assert light.inside.tolist() == [True, False]
    scene = scene_of(*box(1.0, inwards=False), lights=lamp(LightKind.POINT, 3.0, position=(0, 0, 0.5)))
    assert not light_at(scene, places((0, 0, 0)), 64).inside.any()


def test_caustics_are_flights_near_by():
    """A beam of parallel photons, of an irradiance of 2 W/m² across, that comes from above."""
    random, n = np.random.default_rng(3), 40_000
    origin = np.column_stack([random.uniform(-1, 1, (n, 2)), np.ones(n)]).astype(np.float32)
    down = np.tile(np.float32([0, 0, -1]), (n, 1))
    power = np.full((n, 3), 2 * 4 / n, np.float32)
    flights = Flights(origin, down, np.full(n, 2, np.float32), power, np.ones(n, bool))
    light = caustics_at_probes(flights, np.zeros((1, 3), np.float32), 400, Workers())
    error = 4 * 2 / np.sqrt(400)
    assert light.irradiance[0, 4, 0] == pytest.approx(2, abs=error) and not light.irradiance[0, 5].any()
    assert light.sh[0, 3, 0] == pytest.approx(2 * Y1, abs=error * Y1)
    assert light.stderr[0, N_SH + 4] == pytest.approx(2 / np.sqrt(400), rel=0.3)


def test_grid_lies_in_the_middle_of_texels():
    grid = grid_in_box("Box", (0, 0, 0), (4, 2, 1), 1.0, 1000)
    assert grid.counts == (4, 2, 1) and grid.n_probes == 8
    assert grid.positions[:5] == pytest.approx(
        np.array([(0.5, 0.5, 0.5), (1.5, 0.5, 0.5), (2.5, 0.5, 0.5), (3.5, 0.5, 0.5), (0.5, 1.5, 0.5)])
    )
    assert grid_in_box("Flat", (0, 0, 0), (4, 2, 0), 1.0, 1000).counts == (4, 2, 1)
    assert 50 < grid_in_box("Fine", (0, 0, 0), (4, 2, 1), 0.01, 100).n_probes <= 100


def test_wide_ground_is_not_filled():
    """A plane of 200 m under a house is left out, the walls of a room around its furniture are not."""
    random = np.random.default_rng(4)
    low = random.uniform(-4, 4, (30, 3))
    high = low + 1
    for half, kept in ((100, False), (6, True)):
        lows, highs = np.vstack([low, [3 * [-half]]]), np.vstack([high, [3 * [half]]])
        assert without_surroundings(lows, highs).tolist() == [*30 * [True], kept]
    assert without_surroundings(low[:1], high[:1]).all() and without_surroundings(low[:2], high[:2] + 99).all()


def test_a_world_that_is_an_image():
    """Bright above the horizon, dark below it: as half a sky, by next-event estimation and rays together."""
    pixels = np.zeros((32, 64, 3), np.float32)
    pixels[16:] = 1.0
    scene = replace(floor_below(), world=World(np.ones(3, np.float32), pixels))
    light = light_at(scene, places((0, 0, 0)), add_direct=True)
    assert light.sh[0, [0, 3], 0] == pytest.approx([2 * np.pi * Y0, np.pi * Y1], rel=0.05)
    assert light.irradiance[0, 4:, 0] == pytest.approx([np.pi, 0], abs=0.15)
