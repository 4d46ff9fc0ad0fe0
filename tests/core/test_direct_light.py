"""Next-event estimation against closed forms for every lamp."""

import numpy as np
import pytest
from photon_bake.addon.gather import DirectLight, direct_irradiance
from photon_bake.addon.parallel import Workers
from photon_bake.addon.photons import Sphere, light_sources
from photon_bake.addon.sampling.streams import stream
from photon_bake.addon.scene import LightKind, Lights
from photon_bake.addon.tracers.embree import EmbreeTracer
from photon_bake.tests.core.scenes import lamp, merge, plane, receivers_at, scene_of


def direct_of(scene):
    tracer = EmbreeTracer(scene)
    return DirectLight(scene, tracer, light_sources(scene, Sphere(np.zeros(3, np.float32), 2.0)))


def irradiance(position, normal, lights=None, n=40_000, **scene):
    """Mean of n estimates at one point, and its standard error."""
    mesh = scene.pop("mesh", plane(0.1, z=-50.0))
    direct = direct_of(scene_of(*mesh, lights=lights, **scene))
    at = receivers_at(np.repeat([position], n, 0), normal)
    values = direct.irradiance(at.position, at.normal, stream(9)).mean(axis=1, dtype=np.float64)
    return values.mean(), values.std() / np.sqrt(n)


UP = (0, 0, 1)


def test_point_lamp():
    value, _ = irradiance((0.5, 0, 0), UP, lamp(LightKind.POINT, 7.0, position=(0, 0, 2)))
    d2 = 0.25 + 4
    assert value == pytest.approx(7 / d2 * 2 / np.sqrt(d2), rel=1e-5)


@pytest.mark.parametrize("radius", [0.01, 0.5])
def test_point_lamp_with_a_radius_is_a_disc_that_faces_the_point(radius):
    value, error = irradiance((0, 0, 0), UP, lamp(LightKind.POINT, 7.0, position=(0, 0, 2), radius=radius))
    assert abs(value - 7 / (4 + radius**2)) < 4 * error + 1e-5


@pytest.mark.parametrize("blend", [0.0, 0.3, 1.0])
def test_spot(blend):
    spot = lamp(LightKind.SPOT, 7.0, position=(0, 0, 2), angle=np.radians(80), blend=blend)
    assert irradiance((0, 0, 0), UP, spot)[0] == pytest.approx(7 / 4, rel=1e-5)
    assert irradiance((2, 0, 0), UP, spot)[0] == 0  # 45° from the axis, outside the cone of 40°
    cosine = np.cos(np.radians(35))
    inside = irradiance((2 * np.tan(np.radians(35)), 0, 0), UP, spot)[0]
    t = min((cosine - np.cos(np.radians(40))) / max(blend * (1 - np.cos(np.radians(40))), 1e-5), 1)
    assert inside == pytest.approx(7 / 4 * cosine**3 * t * t * (3 - 2 * t), rel=1e-3)


@pytest.mark.parametrize("angle", [0.0, 0.1, 1.5])
def test_sun(angle):
    sun = lamp(LightKind.SUN, 3.0, direction=(0, 0, -1), angle=angle)
    value, error = irradiance((0, 0, 0), UP, sun)
    assert abs(value - 3) < 4 * error + 1e-5
    assert irradiance((0, 0, 0), (0, 0, -1), sun)[0] == 0


def test_ellipse_is_a_disc_when_round():
    """On the axis of a disc of radius r: E = πL r²/(d² + r²)."""
    value, error = irradiance((0, 0, 0), UP, lamp(LightKind.ELLIPSE, 2.0, position=(0, 0, 1), size=(1, 1)))
    assert abs(value - np.pi * 2 * 0.25 / 1.25) < 4 * error


def test_rectangle():
    """Below the middle of a rectangle 2a × 2b at distance d: four times the corner's configuration factor."""
    a, b, d = 0.4, 0.9, 1.0
    value, error = irradiance((0, 0, 0), UP, lamp(LightKind.RECTANGLE, 2.0, position=(0, 0, d), size=(2 * a, 2 * b)))
    x, y = a / d, b / d
    corner = (
        x / np.hypot(1, x) * np.arctan(y / np.hypot(1, x)) + y / np.hypot(1, y) * np.arctan(x / np.hypot(1, y))
    ) / (2 * np.pi)
    assert abs(value - np.pi * 2 * 4 * corner) < 4 * error


def test_area_lamps_shine_from_their_front_only():
    behind = lamp(LightKind.RECTANGLE, 2.0, position=(0, 0, 1), size=(1, 1), direction=(0, 0, 1))
    assert irradiance((0, 0, 0), UP, behind)[0] == 0


def test_emissive_mesh_is_an_area_lamp_with_two_sides():
    mesh = plane(0.5, z=1.0)
    lamp_value, lamp_error = irradiance((0.2, 0, 0), UP, lamp(LightKind.RECTANGLE, 2.0, position=UP, size=(1, 1)))
    for side in (0, 2):
        value, error = irradiance((0.2, 0, side), (0, 0, 1 - side), mesh=mesh, emission=2.0)
        assert abs(value - lamp_value) < 4 * np.hypot(error, lamp_error)


def test_shadow():
    lights = lamp(LightKind.POINT, 7.0, position=(0, 0, 2))
    mesh = plane(0.5, z=1.0)
    assert irradiance((0, 0, 0), UP, lights, mesh=mesh)[0] == 0
    assert irradiance((1.5, 0, 0), UP, lights, mesh=mesh)[0] > 0


def test_many_lamps_add_up():
    """Candidates of very different strength and distance: the mean is the sum of what each lamp gives alone."""
    random = np.random.default_rng(8)
    lamps = [
        lamp(LightKind.POINT, 10 ** random.uniform(-2, 2), position=np.add(random.uniform(-2, 2, 3), (0, 0, 2.5)))
        for _ in range(12)
    ]
    lamps += [
        lamp(LightKind.RECTANGLE, 5.0, position=(1, 1, 1), size=(0.3, 0.3)),
        lamp(LightKind.SUN, 0.5, direction=(1, 0, -1)),
    ]
    alone = sum(irradiance((0, 0, 0), UP, one, n=4000)[0] for one in lamps)
    value, error = irradiance((0, 0, 0), UP, Lights.join(lamps), n=200_000)
    assert abs(value - alone) < 4 * error and error < 0.01 * alone


def test_point_in_the_lamp_is_finite():
    value, _ = irradiance((0, 0, 2), UP, lamp(LightKind.POINT, 7.0, position=(0, 0, 2)), n=100)
    assert np.isfinite(value)


def test_receivers_get_the_same_for_any_threads():
    scene = scene_of(
        *merge(plane(2.0), plane(0.3, z=0.5)), lights=lamp(LightKind.RECTANGLE, 2.0, position=(0, 0, 1), size=(1, 1))
    )
    direct = direct_of(scene)
    at = receivers_at(np.random.default_rng(1).uniform(-1, 1, (3000, 3)) * [1, 1, 0] + [0, 0, 1e-3], UP)
    one, two = (direct_irradiance(direct, at, Workers(5, n_threads)) for n_threads in (1, 3))
    assert np.array_equal(one, two) and one.max() > 0
