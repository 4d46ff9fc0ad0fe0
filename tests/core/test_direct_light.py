"""Next-event estimation against closed forms for every lamp."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.sampling.path_numbers import path_key
from photon_bake.addon.core.sampling.streams import stream
from photon_bake.addon.emitters import Sphere, light_sources
from photon_bake.addon.emitters.area import areas_of
from photon_bake.addon.gather import DirectLight, direct_irradiance
from photon_bake.addon.scene import Channel, LightKind, Lights, Textures, World
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import fewer, lamp, merge, plane, receivers_at, scene_of
from photon_bake.tests.core.world_loops import radiance_along

MANY = fewer(40_000)


def direct_of(scene):
    tracer = TransparencyTracer(scene, EmbreeTracer(scene))
    return DirectLight(scene, tracer, light_sources(scene, Sphere(np.zeros(3, np.float32), 2.0)))


def irradiance(position, normal, lights=None, n=MANY, **scene):
    """Mean of n estimates at one point, and its standard error."""
    mesh = scene.pop("mesh", plane(0.1, z=-50.0))
    return mean_at(scene_of(*mesh, lights=lights, **scene), position, normal, n)


def mean_at(scene, position, normal, n=MANY, objects=None):
    """As `irradiance`, of a scene, and of light that is linked to `objects`."""
    direct = direct_of(scene)
    at = receivers_at(np.repeat([position], n, 0), normal)
    objects = None if objects is None else np.full(n, objects, np.int32)
    values = direct.irradiance(at.position, at.normal, objects, stream(9)).mean(axis=1, dtype=np.float64)
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


@pytest.mark.parametrize("radius", [1e-4, 0.5, 1.9])
def test_sphere(radius):
    """A sphere that is all above the horizon gives what its middle would: E = πL r²/d² = I/d²."""
    sphere = lamp(LightKind.POINT, 7.0, position=(0, 0, 2), radius=radius, sphere=True)
    value, error = irradiance((0, 0, 0), UP, sphere)
    assert abs(value - 7 / 4) < 4 * error + 1e-4
    tilted, error = irradiance((0, 0, 0), (0.6, 0, 0.8), sphere)
    assert radius > 1 or abs(tilted - 0.8 * 7 / 4) < 4 * error + 1e-4


def test_inside_a_sphere_all_directions_shine():
    value, error = irradiance((0.3, 0, 0), UP, lamp(LightKind.POINT, 7.0, position=(0, 0, 0), radius=0.5, sphere=True))
    assert abs(value - 7 / 0.25) < 4 * error  # πL, L = I/(πr²)


def test_stretched_spot():
    spot = lamp(LightKind.SPOT, 7.0, position=(0, 0, 2), angle=np.radians(60), stretch=(3, 0.5))
    axes = np.concatenate([spot.axis_x, spot.axis_y])
    for axis, factor in zip(axes, (3, 0.5), strict=True):
        edge = 2 * factor * np.tan(np.radians(30))
        for share, lit in ((0.97, True), (1.03, False)):
            assert (irradiance(axis * edge * share, UP, spot, n=100)[0] > 0) == lit


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


@pytest.mark.parametrize("kind", [LightKind.RECTANGLE, LightKind.ELLIPSE])
@pytest.mark.parametrize("spread", [0.05, 0.4, 1.5, 3.0])
def test_spread(kind, spread):
    """The irradiance of a plane below a lamp adds up to the lamp's power, wherever it falls."""
    light = lamp(kind, 2.0, position=(0, 0, 1), size=(1, 0.5), spread=spread)
    at = np.random.default_rng(2).uniform(-1, 1, (400_000, 3)) * [1, 1, 0]
    half = 0.5 + min(np.tan(spread / 2), 20)
    at[:, :2] *= half
    at = receivers_at(at, UP)
    direct = direct_of(scene_of(*plane(0.1, z=-50), lights=light))
    values = direct.irradiance(at.position, at.normal, None, stream(9))[:, 0].astype(np.float64) * (2 * half) ** 2
    power = np.pi * 2 * areas_of(light)[0]
    assert abs(values.mean() - power) < 4 * values.std() / np.sqrt(len(values)) + 0.01 * power


def test_area_lamps_shine_from_their_front_only():
    behind = lamp(LightKind.RECTANGLE, 2.0, position=(0, 0, 1), size=(1, 1), direction=(0, 0, 1))
    assert irradiance((0, 0, 0), UP, behind, mesh=plane(2.0, z=-0.1))[0] == 0


def test_emissive_mesh_is_an_area_lamp_with_two_sides():
    mesh = plane(0.5, z=1.0)
    lamp_value, lamp_error = irradiance((0.2, 0, 0), UP, lamp(LightKind.RECTANGLE, 2.0, position=UP, size=(1, 1)))
    for side in (0, 2):
        value, error = irradiance((0.2, 0, side), (0, 0, 1 - side), mesh=mesh, emission=2.0)
        assert abs(value - lamp_value) < 4 * np.hypot(error, lamp_error)


@pytest.mark.parametrize("with_sky", [False, True])
def test_negative_light_takes_light_away(with_sky):
    """An emissive square of −2 and a sky of −L give the negative of what they give otherwise."""
    world = sky_of() if with_sky else World.constant(0)
    scene = replace(scene_of(*plane(0.5, z=1.0), emission=2.0), world=world)
    dark = replace(scene.materials, emission=Channel.constant(-scene.materials.emission.value))
    negative = replace(scene, materials=dark, world=replace(world, color=-world.color))
    value, error = mean_at(scene, (0.2, 0, 0), UP)
    assert value > 0
    assert mean_at(negative, (0.2, 0, 0), UP)[0] == pytest.approx(-value, abs=4 * error)


def test_shadow():
    lights = lamp(LightKind.POINT, 7.0, position=(0, 0, 2))
    mesh = plane(0.5, z=1.0)
    assert irradiance((0, 0, 0), UP, lights, mesh=mesh)[0] == 0
    assert irradiance((1.5, 0, 0), UP, lights, mesh=mesh)[0] > 0


def linked(lights, **links):
    return replace(lights, **{name: np.array(rows, bool) for name, rows in links.items()})


def test_lamps_light_what_they_illuminate():
    two = Lights.join([lamp(LightKind.POINT, 7.0, position=(0, 0, 2)), lamp(LightKind.POINT, 5.0, position=(0, 0, 2))])
    scene = scene_of(*plane(0.1, z=-50), lights=linked(two, illuminates=[[1, 0], [1, 1]]))
    for objects, expected in ((0, 12 / 4), (1, 5 / 4), (None, 12 / 4)):
        value, error = mean_at(scene, (0, 0, 0), UP, objects=objects)
        assert abs(value - expected) < 4 * error + 1e-5


def test_shadows_of_what_blocks():
    """Of two triangles one above the other only the blocking one counts, whichever is met first."""
    mesh = (np.array([(-9, -9, z) for z in (0.5, 1)] + [(9, -9, 0.5), (9, -9, 1), (0, 9, 0.5), (0, 9, 1)], np.float32),)
    mesh += (np.array([(0, 2, 4), (1, 3, 5)]),)
    lights = lamp(LightKind.POINT, 8.0, position=(0, 0, 2))
    for row, expected in (([1, 1], 0), ([1, 0], 0), ([0, 1], 0), ([0, 0], 2)):
        scene = scene_of(*mesh, lights=linked(lights, blocked_by=[row]))
        assert mean_at(scene, (0, 0, 0), UP, n=100)[0] == pytest.approx(expected)


def sky_of(seed=3, color=(1, 1, 1)):
    """A dim world with a bright patch high in the sky."""
    random = np.random.default_rng(seed)
    image = random.uniform(0.1, 0.5, (32, 64, 3)).astype(np.float32)
    image[22:26, 10:14] = 60
    return World(np.array(color, np.float32), image)


@pytest.mark.parametrize("normal", [(0, 0, 1), (0.6, 0, -0.8), (0, 1, 0)])
def test_world_image(normal):
    """E = ∫ L cos θ dω over the pixels, by sampling the world and by the rays that own part of it."""
    world = sky_of(color=(1, 0.5, 2))
    scene = replace(scene_of(*plane(0.1, z=-50)), world=world)
    value, error = mean_at(scene, (0, 0, 0), normal, 200_000)
    from_world = np.random.default_rng(1).normal(size=(2_000_000, 3))
    from_world /= np.linalg.norm(from_world, axis=1, keepdims=True)
    at_random = (
        radiance_along(world, from_world.astype(np.float32)).mean(1) * np.maximum(from_world @ normal, 0) * 4 * np.pi
    )
    assert abs(value - at_random.mean()) < 4 * np.hypot(error, at_random.std() / np.sqrt(len(at_random)))
    assert error < 0.005 * value


def test_all_of_a_sampled_source_is_found_without_rays():
    """What `rays_own` leaves out and what it does not add up to the same; so do the directions of its parts."""
    scene = replace(scene_of(*plane(0.5, z=0.05), emission=2.0), world=sky_of())
    direct = direct_of(scene)
    at = receivers_at(np.repeat([[0.1, 0.2, 0]], 400_000, 0), UP)
    alone = direct.sample(at.position, at.normal, None, stream(1), rays_own=False)
    with_rays = direct.irradiance(at.position, at.normal, None, stream(2))
    values = [v.mean(axis=1, dtype=np.float64) for v in (alone.irradiance, with_rays)]
    error = np.hypot(*(v.std() / np.sqrt(len(v)) for v in values))
    assert abs(values[0].mean() - values[1].mean()) < 4 * error
    lit = alone.irradiance.any(axis=1)
    assert np.allclose(np.linalg.norm(alone.direction[lit], axis=1), 1, atol=1e-5)
    assert (alone.direction[lit, 2] > 0).all()


def test_constant_world_is_for_rays():
    direct = direct_of(scene_of(*plane(0.1, z=-50), world=0.5))
    at = receivers_at(np.zeros((1000, 3)), UP)
    assert not direct.irradiance(at.position, at.normal, None, stream(1)).any()
    assert np.allclose(direct.irradiance(at.position, at.normal, None, stream(1), with_sky=True), np.pi / 2)


def test_textured_emission():
    """A square with a bright quarter gives what an area lamp in its place would."""
    pixels = np.zeros((2, 2, 3), np.float32)
    pixels[1, 1] = 8
    scene = scene_of(*plane(0.5, z=1.0), emission=1.0)
    emission = Channel(scene.materials.emission.value, np.zeros(1, np.int32))
    materials = replace(scene.materials, emission=emission, textures=Textures.pack([pixels]))
    value, error = mean_at(replace(scene, materials=materials), (0, 0, 0), UP)
    quarter = lamp(LightKind.RECTANGLE, 8.0, position=(-0.25, -0.25, 1), size=(0.5, 0.5))
    expected, error_of_lamp = irradiance((0, 0, 0), UP, quarter)
    assert abs(value - expected) < 4 * np.hypot(error, error_of_lamp)


def test_objects_that_do_not_emit():
    scene = scene_of(*plane(0.5, z=1.0), emission=1.0)
    both, _ = mean_at(scene, (0, 0, 0), UP)
    one = replace(scene, objects=replace(scene.objects, emits=np.array([True, False])))
    assert mean_at(one, (0, 0, 0), UP)[0] == pytest.approx(both / 2, rel=0.02)


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


def test_estimates_do_not_depend_on_chunks():
    lights = lamp(LightKind.RECTANGLE, 2.0, position=(0, 0, 1), size=(1, 1))
    direct = direct_of(scene_of(*plane(2.0), lights=lights, world=0.3))
    at = receivers_at(np.random.default_rng(1).uniform(-1, 1, (300, 3)) * [1, 1, 0] + [0, 0, 1e-3], UP)
    whole = direct.mean_irradiance(at.position, at.normal, None, 4, path_key(1, 2))
    part = direct.mean_irradiance(at.position[200:], at.normal[200:], None, 4, path_key(1, 2), first=200)
    assert np.array_equal(whole[200:], part)


def test_receivers_get_the_same_for_any_threads():
    scene = scene_of(
        *merge(plane(2.0), plane(0.3, z=0.5)), lights=lamp(LightKind.RECTANGLE, 2.0, position=(0, 0, 1), size=(1, 1))
    )
    direct = direct_of(scene)
    at = receivers_at(np.random.default_rng(1).uniform(-1, 1, (3000, 3)) * [1, 1, 0] + [0, 0, 1e-3], UP)
    one, two = (direct_irradiance(scene, direct, at, Workers(5, n_threads)) for n_threads in (1, 3))
    assert np.array_equal(one, two) and one.max() > 0
