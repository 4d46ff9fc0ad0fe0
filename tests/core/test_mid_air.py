"""Density estimates on objects that no light stops at: closed forms of a mirror in the sun and of a ball of glass."""

from dataclasses import fields

import numpy as np
import pytest
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.emitters import Sphere, light_sources
from photon_bake.addon.gather.density.disc_density import DiscDensity, MidAir
from photon_bake.addon.photons import FlightLog, Flights, PathKind, Photons, trace_photons
from photon_bake.addon.pipeline.bake import solve
from photon_bake.addon.pipeline.gathers import caustics_of
from photon_bake.addon.scene import LightKind
from photon_bake.addon.settings.bake import settings_for
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import lamp, merge, plane, receivers_at, scene_of
from photon_bake.tests.core.test_caustics import REGION, SUN, ball_power, glass_ball, with_lobes

WALL = np.float32([(0, -1, 0.2), (0, 1, 0.2), (0, 1, 0.8), (0, -1, 0.8)]), np.int32([[0, 1, 2], [0, 2, 3]])
GATHERS = ["final", "density"]


def over_mirror():
    """A mirror that sends the sun straight up, a thin wall that stands above it, and a dark floor far below."""
    lights = lamp(LightKind.SUN, SUN, direction=(0, 0, -1))
    return with_lobes(merge(plane(20.0, -5), WALL, plane()), 4, lights, f0=1.0, f90=1.0)


def grid(x, z, n=12):
    """Points at several x, and n² of y and a bit of x."""
    y = (np.arange(n) + 0.5) / n - 0.5
    return np.float32([(a + 0.02 * b, b, z) for a in x for b in y])


def caustics(scene, receivers, gather, n_photons=300_000, n_nearest=400):
    settings = settings_for("draft", gather=gather, n_photons=n_photons, n_nearest=n_nearest, seed=3)
    solution = solve(scene, receivers, settings, EmbreeTracer(scene))
    return caustics_of(solution)[0].irradiance[:, 0], solution


@pytest.mark.parametrize("gather", GATHERS)
def test_mirrored_sun_lights_what_no_ray_sees(gather):
    """E = E_sun cos θ at any height, beside the wall too; and none comes from the front of what faces up."""
    scene = over_mirror()
    at = grid([-0.5, -0.25, -0.03, 0.03, 0.25, 0.5], 0.5)
    for angle in (0.0, 0.6):
        light, solution = caustics(scene, receivers_at(at, (0, np.sin(angle), -np.cos(angle))), gather)
        assert len(solution.mid_air.rows) == len(at)
        assert light.mean() == pytest.approx(SUN * np.cos(angle), rel=0.03)
        assert light.reshape(6, -1).mean(axis=1) == pytest.approx(SUN * np.cos(angle), rel=0.1)
    light, _ = caustics(scene, receivers_at(at, (0, 0, 1)), gather)
    assert (light == 0).all()


def test_plate_just_above_a_floor_has_the_floor_s_caustic_once():
    """Mid-air and floor, a hair apart, are lit by the same photons, each once."""
    scene = glass_ball(0.48)
    at = grid(np.linspace(-0.25, 0.25, 9), 0.0)
    floor, on_floor = caustics(scene, receivers_at(at + np.float32([0, 0, 5e-4]), (0, 0, 1)), "density")
    above, in_air = caustics(scene, receivers_at(at + np.float32([0, 0, 2e-3]), (0, 0, 1)), "density")
    assert on_floor.mid_air is None and len(in_air.mid_air.rows) == len(at)
    assert above.mean() == pytest.approx(floor.mean(), rel=0.03)


def test_flights_through_a_plate_have_the_ball_s_power_and_change_no_photons():
    scene = glass_ball()
    tracer, sources, z = TransparencyTracer(scene, EmbreeTracer(scene)), light_sources(scene, REGION), 0.1
    log = FlightLog(Sphere(np.float32([0, 0, z]), 0.5))
    n = 2_400_000  # of which a hundredth meets the ball: a noise of 0.6 %
    photons = trace_photons(scene, tracer, sources, n, 12, Workers(5, 2), log=log)
    flights = log.flights()
    t = (z - flights.origin[:, 2]) / flights.direction[:, 2]
    crosses = (t >= 0) & (t <= flights.length) & (flights.direction[:, 2] < 0)
    from_axis = np.linalg.norm((flights.origin + t[:, None] * flights.direction)[:, :2], axis=1)
    for within in (0.05, 0.2, 0.4):
        power = flights.power[crosses & (from_axis < within), 0].sum()
        assert power == pytest.approx(ball_power(0.4, within), rel=0.02)

    assert same(photons, trace_photons(scene, tracer, sources, n, 12, Workers(5, 2)))
    again = FlightLog(log.ball)
    trace_photons(scene, tracer, sources, n, 12, Workers(5, 1), log=again)
    assert same(flights, again.flights())


def same(a: Photons | Flights, b: Photons | Flights) -> bool:
    return all(np.array_equal(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))


class Nothing:
    """A tracer that hides nothing."""

    def occluded(self, origins, targets):
        return np.zeros(len(origins), bool)


@pytest.mark.parametrize("k", [8, 50, 3000])
def test_nearest_flights_are_found_whatever_the_discs_normals(k):
    random = np.random.default_rng(1)
    origin, target = random.uniform(-1, 1, (2, 4000, 3)).astype(np.float32)
    length = np.linalg.norm(target - origin, axis=1)
    direction = (target - origin) / length[:, None]
    power = random.uniform(0, 1, (4000, 3)).astype(np.float32)
    flights = Flights(origin, direction, length, power, np.ones(4000, bool))
    normals = random.normal(size=(70, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    receivers = receivers_at(random.uniform(-0.4, 0.4, (70, 3)), normals)
    r_max = 0.3
    density = DiscDensity(Nothing(), flights, Sphere(np.zeros(3, np.float32), 2.0), k, r_max)
    found = density.at(receivers, Workers()).irradiance
    for x, normal, light in zip(receivers.position, normals, found, strict=True):
        fall, height = direction @ normal, (origin - x) @ normal
        t = -height / fall
        away = np.linalg.norm(origin + t[:, None] * direction - x, axis=1)
        away[(fall >= 0) | (t < 0) | (t > length)] = np.inf
        r = min(np.sort(away)[k - 1], r_max)
        assert light == pytest.approx(power[away < r].sum(axis=0) / (np.pi * r**2), rel=1e-3)


def test_all_receivers_on_surfaces_cost_no_log():
    scene = glass_ball()
    receivers = receivers_at(grid([-0.2, 0.0, 0.2], 5e-4), (0, 0, 1))
    assert caustics(scene, receivers, "final", 10_000)[1].mid_air is None


def test_receivers_just_off_a_tip_are_on_its_surface():
    """No surface may be beneath a receiver at a tip, by a hair."""
    scene = scene_of([(0, 0, 0), (1, 0.2, 0), (1, -0.2, 0)], [(0, 2, 1)])
    tracer = TransparencyTracer(scene, EmbreeTracer(scene))
    assert MidAir.of(scene, tracer, receivers_at((-2e-4, 0, 1e-4), (0, 0, 1)), True) is None
    assert list(MidAir.of(scene, tracer, receivers_at([(-2e-4, 0, 1e-4), (0.5, 0, 0.1)], (0, 0, 1)), True).rows) == [1]


def test_scattered_light_in_mid_air_is_in_the_density_gather():
    """Over a sunlit matte floor of albedo ρ half as wide as high: E = ρ E_sun F, F of a square's middle at height h."""
    scene = with_lobes(merge(plane(1.0), plane(0.1, -3)), 2, lamp(LightKind.SUN, SUN, direction=(0, 0, -1)), f0=0.0)
    at = receivers_at(grid([-0.05, 0.0, 0.05], 1.0) * np.float32([1, 0.1, 1]), (0, 0, -1))
    solution = caustics(scene, at, "density", 600_000, 1600)[1]  # all see about the same flights: a noise of 1/√1600
    light = solution.irradiance().value[:, 0]
    form = 4 * 2 / (2 * np.pi) * (1 / np.sqrt(2)) * np.arctan(1 / np.sqrt(2))
    assert light.mean() == pytest.approx(0.5 * SUN * form, rel=0.05)
    assert (solution.photons.kind != PathKind.CAUSTIC).all()
