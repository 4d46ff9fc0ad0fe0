"""Every source: its power against the lamp's formula, and its photons against the irradiance they make."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.core.sampling.sobol import sobol_points, sobol_seeds
from photon_bake.addon.core.sampling.streams import stream
from photon_bake.addon.emitters import Sphere, light_sources
from photon_bake.addon.emitters.emission import N_DIMENSIONS
from photon_bake.addon.emitters.mesh import emissive_triangles, radiance_of
from photon_bake.addon.emitters.source import emitted as emitted_by
from photon_bake.addon.gather import DirectLight
from photon_bake.addon.scene import Channel, LightKind, Lights, Textures, World
from photon_bake.addon.tracing import TransparencyTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import chi_square_of_directions, fewer, lamp, merge, plane, scene_of

WHOLE = Sphere(np.zeros(3, np.float32), 3.0)
N = fewer(1 << 17)


def source_of(lights=None, region=WHOLE, **scene):
    mesh = scene.pop("mesh", plane(2.0))
    (source,) = light_sources(scene_of(*mesh, lights=lights, **scene), region)
    return source


def emitted(source, n=N, seed=11):
    return source.emit(sobol_points(sobol_seeds(1, seed), 0, 0, n))


def power_on_plane(rays, half=1.0, z=0.0):
    """Power of the rays that come down through the square |x|, |y| < half at height z, W (mean over colours)."""
    d = rays.directions
    t = (z - rays.origins[:, 2]) / np.where(d[:, 2] < 0, d[:, 2], -1)
    at = rays.origins + t[:, None] * d
    through = (d[:, 2] < 0) & (t > 0) & (np.abs(at[:, :2]) < half).all(1)
    return (rays.flux.mean(1) * through).mean(dtype=np.float64)


POWERS = [
    (lamp(LightKind.POINT, 10 / (4 * np.pi)), 10.0),
    (lamp(LightKind.POINT, 10 / (4 * np.pi), radius=0.3), 10.0),
    (lamp(LightKind.SPOT, 2.0, angle=np.radians(60), blend=0.0), 2 * 2 * np.pi * (1 - np.cos(np.radians(30)))),
    (lamp(LightKind.SPOT, 2.0, angle=np.radians(60), blend=1.0), 2 * np.pi * (1 - np.cos(np.radians(30)))),
    (lamp(LightKind.SPOT, 2.0, angle=np.radians(170), blend=0.4), 2 * 2 * np.pi * (1 - np.cos(np.radians(85))) * 0.8),
    (lamp(LightKind.SPOT, 2.0, angle=np.radians(60), stretch=(1, 1.0001)), 4 * np.pi * (1 - np.cos(np.radians(30)))),
    (lamp(LightKind.RECTANGLE, 3.0, size=(0.5, 2)), 3 * np.pi * 1.0),
    (lamp(LightKind.RECTANGLE, 3.0, size=(0.5, 2), spread=0.3), 3 * np.pi * 1.0),
    (lamp(LightKind.RECTANGLE, 3.0, size=(0.5, 2), spread=2.9), 3 * np.pi * 1.0),
    (lamp(LightKind.RECTANGLE, 3.0, size=(0.5, 2), spread=0.0), 3 * np.pi * 1.0),
    (lamp(LightKind.ELLIPSE, 3.0, size=(0.5, 2)), 3 * np.pi * np.pi / 4),
]


@pytest.mark.parametrize("lights, watts", POWERS)
def test_power_of_lamps(lights, watts):
    source = source_of(lights)
    assert source.power.mean() == pytest.approx(watts, rel=1e-3)
    assert emitted(source).flux.mean() == pytest.approx(watts, rel=2e-3)


def test_emissive_mesh_shines_from_both_sides():
    source = source_of(mesh=plane(0.5), emission=3.0)
    rays = emitted(source)
    assert source.power.mean() == pytest.approx(2 * np.pi * 3 * 1.0)
    assert rays.flux.mean() == pytest.approx(source.power.mean(), rel=1e-5)
    assert (rays.directions[:, 2] > 0).mean() == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize("front, back", [(3.0, 0.0), (0.0, 3.0), (3.0, 1.0)])
@pytest.mark.parametrize("region", [WHOLE, Sphere(np.array([0, 0, 30], np.float32), 1.0)])
def test_emissive_mesh_whose_sides_differ(front, back, region):
    """Power π L A of each side, and photons that make the irradiance of direct light before each."""
    scene = scene_of(*plane(0.5), albedo=[0, 0], emission=[front, back])
    materials = replace(scene.materials, seen_as=np.int32([[0, 1] * 6, [1] * 12]))
    scene = replace(scene, materials=materials)
    (source,) = light_sources(scene, region)
    assert source.power.mean() == pytest.approx(np.pi * (front + back))
    rays, up = emitted(source), np.tile(np.float32([0, 0, 1]), (N // 4, 1))
    direct = DirectLight(scene, TransparencyTracer(scene, EmbreeTracer(scene)), [source])
    upwards = rays.directions[:, 2] > 0
    for side, radiance, goes in ((1, front, upwards), (-1, back, ~upwards)):
        assert (rays.flux.mean(axis=1) * goes).mean() == pytest.approx(np.pi * radiance, rel=0.02)
        light = direct.irradiance(side * up, -side * up, None, stream(2)).mean()
        half = 0.5 / np.hypot(1, 0.5) * np.arctan(0.5 / np.hypot(1, 0.5))
        assert light == pytest.approx(radiance * 4 * half, rel=0.02)


def test_emissive_triangles_share_by_power():
    """But for a tenth, which goes evenly to all objects."""
    mesh = merge(plane(1.0), plane(0.5, z=1))
    rays = emitted(source_of(mesh=mesh, albedo=[0.5, 0.5], emission=[1.0, 8.0], material=[0, 0, 1, 1]))
    assert (rays.origins[:, 2] > 0.5).mean() == pytest.approx(0.9 * 2 / 3 + 0.1 / 2, abs=1e-2)


@pytest.mark.parametrize("coverage", [0.0, 0.25, 1.0])
def test_what_is_see_through_shines_as_much_less(coverage):
    """Power, photons, and direct light: L times the coverage."""
    lamps, floor = plane(0.5, z=1), plane(0.1)
    scene = scene_of(*merge(lamps, floor), albedo=[0, 0], emission=[3.0, 0], material=[0, 0, 1, 1])
    materials = replace(scene.materials, coverage=Channel.constant(np.float32([coverage, 1])))
    scene = replace(scene, materials=materials)
    _, _, power = emissive_triangles(scene)
    assert power.sum() / 3 == pytest.approx(2 * np.pi * 3 * coverage)
    assert radiance_of(scene.arrays, np.array([0, 2]), *np.float32([[0.3, 0.3], [0.3, 0.3]])).mean(
        axis=1
    ) == pytest.approx([3 * coverage, 0])
    if coverage == 0:
        return
    sources = light_sources(scene, WHOLE)
    assert emitted(sources[0]).flux.mean() == pytest.approx(2 * np.pi * 3 * coverage, rel=1e-3)
    tracer, up = TransparencyTracer(scene, EmbreeTracer(scene)), np.tile(np.float32([0, 0, 1]), (N // 4, 1))
    at = 1e-3 * up
    light = DirectLight(scene, tracer, sources).irradiance(at, up, None, stream(2)).mean()
    side = 0.5 / np.hypot(1, 0.5) * np.arctan(0.5 / np.hypot(1, 0.5))
    assert light == pytest.approx(3 * coverage * np.pi * 4 * 2 * side / (2 * np.pi), rel=0.02)


def test_mesh_that_diffuse_rays_do_not_see_emits_nothing():
    assert light_sources(scene_of(*plane(), emission=1.0, hidden=(0, 1)), WHOLE) == []


@pytest.mark.parametrize("height", [1.0, 2.0, 4.0])
def test_inverse_square_of_a_point_lamp(height):
    """A small square below a point lamp gets I·A/h², to within its finite size."""
    half = 0.1
    rays = emitted(source_of(lamp(LightKind.POINT, 5.0, position=(0, 0, height))), 1 << 20)
    solid_angle = 4 * np.arctan(half**2 / (height * np.sqrt(height**2 + 2 * half**2)))
    assert power_on_plane(rays, half) == pytest.approx(5 * solid_angle, rel=0.03)


@pytest.mark.parametrize("tilt", [0.0, 0.6, 1.2])
@pytest.mark.parametrize("region_radius", [0.05, 0.5, 3.0])
def test_sun_gives_its_irradiance(tilt, region_radius):
    """However the photons are aimed, a square facing up gets E cos θ of the sun."""
    sun = lamp(LightKind.SUN, 4.0, direction=(np.sin(tilt), 0, -np.cos(tilt)), angle=0.02)
    rays = emitted(source_of(sun, Sphere(np.array([0.3, 0, 0], np.float32), region_radius)))
    assert power_on_plane(rays) / 4 == pytest.approx(4 * np.cos(tilt), rel=0.02)


@pytest.mark.parametrize("angle", [0.5, 1.5, 2.5])
def test_a_wide_sun_gives_its_irradiance(angle):
    """Across its middle direction, whatever its angle: its photons come from aside too, and are more than E a m²."""
    rays = emitted(source_of(lamp(LightKind.SUN, 4.0, direction=(0, 0, -1), angle=angle)))
    assert power_on_plane(rays) / 4 == pytest.approx(4, rel=0.02)


@pytest.mark.parametrize("region_radius", [0.05, 0.5, 3.0])
def test_world_gives_pi_times_its_radiance(region_radius):
    rays = emitted(source_of(world=0.7, region=Sphere(np.array([0.3, 0, 0], np.float32), region_radius)), 1 << 18)
    assert power_on_plane(rays) / 4 == pytest.approx(np.pi * 0.7, rel=0.02)


def test_distant_rays_start_outside_the_scene():
    for source in (source_of(world=1.0), source_of(lamp(LightKind.SUN, 1.0, direction=(1, 1, -1)))):
        rays = emitted(source)
        assert np.linalg.norm(rays.origins, axis=1).min() > np.sqrt(8) * 0.99


def test_aimed_rays_carry_little_more_than_their_neighbours():
    """In a scene a hundred times wider than the region no photon weighs more than a few times the ones beside it."""
    source = source_of(world=1.0, mesh=plane(100.0), region=Sphere(np.zeros(3, np.float32), 1.0))
    rays = emitted(source)
    miss = np.linalg.norm(np.cross(rays.origins, rays.directions), axis=1)
    near = rays.flux[miss < 1, 0]
    assert near.max() < 5 * np.median(near) and len(near) > N / 20


def test_spot_photons_follow_its_falloff():
    spot = lamp(LightKind.SPOT, 1.0, angle=1.6, blend=0.5)
    rays = emitted(source_of(spot))
    cosine = -rays.directions[:, 2]
    edges = np.linspace(np.cos(0.8), 1, 21)
    flux, _ = np.histogram(cosine, edges, weights=rays.flux[:, 0])
    middle = (edges[1:] + edges[:-1]) / 2
    t = np.clip((middle - np.cos(0.8)) / (0.5 * (1 - np.cos(0.8))), 0, 1)
    expected = t * t * (3 - 2 * t) * 2 * np.pi * np.diff(edges) * N
    assert np.allclose(flux, expected, rtol=0.02, atol=expected.max() * 0.01)


def test_photons_make_the_irradiance_of_direct_light():
    """Photons of lamps of every shape on a floor against next-event estimation there."""
    shapes = [
        lamp(LightKind.SPOT, 2.0, position=(0, 0, 1), angle=1.2, blend=0.3, stretch=(1.6, 0.5)),
        lamp(LightKind.SPOT, 2.0, position=(0, 0, 1), angle=1.2, radius=0.3, sphere=True),
        lamp(LightKind.RECTANGLE, 2.0, position=(0, 0, 1), size=(1, 0.5), spread=1.0),
        lamp(LightKind.ELLIPSE, 2.0, position=(0, 0, 1), size=(1, 0.5), spread=0.3),
    ]
    for lights in shapes:
        scene = scene_of(*plane(2.0, z=-0.01), lights=lights)
        (source,) = light_sources(scene, WHOLE)
        photons = [power_on_plane(emitted(source, 1 << 18), half) for half in (0.2, 0.5)]
        direct = DirectLight(scene, TransparencyTracer(scene, EmbreeTracer(scene)), [source])
        at = np.random.default_rng(2).uniform(-1, 1, (1 << 18, 3)).astype(np.float32) * np.array([1, 1, 0], np.float32)
        up = np.broadcast_to(np.array([0, 0, 1], np.float32), at.shape)
        for half, power in zip((0.2, 0.5), photons, strict=True):
            expected = direct.irradiance(at * half, up, None, stream(4)).mean() * (2 * half) ** 2
            assert power == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize(
    "far",
    [
        lamp(LightKind.POINT, 4e4, position=(60, -80, 20), radius=0.5),
        lamp(LightKind.POINT, 4e4, position=(60, -80, 20), radius=5.0, sphere=True),
        lamp(LightKind.SPOT, 4e4, position=(60, -80, 20), direction=(-60, 80, -20), angle=1.0, blend=1.0),
        lamp(LightKind.SPOT, 4e4, position=(60, -80, 20), direction=(-60, 82, -20), angle=0.03, stretch=(2, 1)),
        lamp(LightKind.RECTANGLE, 4e4, position=(60, -80, 20), direction=(-60, 60, -20), size=(2, 1)),
        lamp(LightKind.ELLIPSE, 4e4, position=(60, -80, 20), direction=(-60, 80, -20), size=(2, 1), spread=0.3),
    ],
)
def test_far_lamps_aim_at_the_scene(far):
    """All photons go there, and make the irradiance of direct light: each of several sequences without a bias.

    Few photons of a large ball fall on the square: a sequence alone is off by 2.8 %.
    """
    scene = scene_of(*plane(2.0, z=-0.01), lights=far)
    (source,) = light_sources(scene, WHOLE)
    rays = emitted(source)
    assert np.linalg.norm(np.cross(rays.origins, rays.directions), axis=1).max() < 13
    assert rays.flux.mean() == pytest.approx(source.power.mean(), rel=0.01)
    direct = DirectLight(scene, TransparencyTracer(scene, EmbreeTracer(scene)), [source])
    at = np.random.default_rng(2).uniform(-1, 1, (1 << 16, 3)).astype(np.float32) * np.array([1, 1, 0], np.float32)
    up = np.broadcast_to(np.array([0, 0, 1], np.float32), at.shape)
    expected = direct.irradiance(at, up, None, stream(4)).mean() * 4
    power = np.array([power_on_plane(emitted(source, seed=seed)) for seed in range(24)])
    assert power.mean() == pytest.approx(expected, rel=0.02)
    assert power.mean() == pytest.approx(expected, rel=5e-4, abs=4 * power.std(ddof=1) / np.sqrt(len(power)))


def test_photons_of_a_world_image_follow_it():
    """Flux by direction is the image's; bright pixels send more photons."""
    image = np.random.default_rng(1).uniform(0, 1, (8, 16, 3)).astype(np.float32) ** 4
    scene = replace(scene_of(*plane(2.0)), world=World(np.array([2, 1, 1], np.float32), image))
    (source,) = light_sources(scene, WHOLE)
    assert source.sampled_directly
    rays = emitted(source)
    z_edges = -np.cos(np.pi * np.arange(9) / 8)
    azimuth = np.arctan2(-rays.directions[:, 1], -rays.directions[:, 0])
    flux, _, _ = np.histogram2d(
        -rays.directions[:, 2], azimuth, [z_edges, np.linspace(-np.pi, np.pi, 17)], weights=rays.flux[:, 0]
    )
    expected = 2 * image[:, ::-1, 0] * np.diff(z_edges)[:, None]
    assert np.allclose(flux / flux.sum(), expected / expected.sum(), atol=1e-3)


def test_textured_triangles_share_by_what_they_emit():
    """Of two triangles of a square, whose picture is black but for one corner, nearly all photons leave one."""
    pixels = np.zeros((4, 4, 3), np.float32)
    pixels[0, 3] = 5
    scene = scene_of(*plane(0.5), emission=2.0)
    emission = Channel(scene.materials.emission.value, np.zeros(1, np.int32))
    scene = replace(scene, materials=replace(scene.materials, emission=emission, textures=Textures.pack([pixels])))
    triangles, chance, _ = emissive_triangles(scene)
    assert len(triangles) == 2 and chance.sum() == pytest.approx(1) and (chance > 0.04).all()
    (source,) = light_sources(scene, WHOLE)
    rays = emitted(source)
    assert source.power.mean() == pytest.approx(2 * np.pi * 10 / 16, rel=0.02)
    assert rays.flux.mean() == pytest.approx(2 * np.pi * 10 / 16, rel=0.02)
    bright = rays.flux[:, 0] > 0
    assert (np.abs(rays.origins[bright, :2] - [-0.125, 0.125]) < 0.126).all()


def test_directions_of_surfaces_are_cosine_weighted():
    rays = emitted(source_of(lamp(LightKind.RECTANGLE, 1.0, size=(1, 1), direction=(0, 0, 1))))
    assert chi_square_of_directions(rays.directions, lambda z: np.maximum(z, 0) / np.pi) > 1e-3


def test_lamps_without_power_are_no_sources():
    lights = Lights.join([lamp(LightKind.POINT, 1.0), lamp(LightKind.POINT, 3.0), lamp(LightKind.POINT, 0.0)])
    sources = light_sources(scene_of(*plane(), lights=lights), WHOLE)
    assert [source.name for source in sources] == ["Lamp", "Lamp"]


def test_a_lamp_without_power_is_no_source():
    assert light_sources(scene_of(*plane(), lights=lamp(LightKind.POINT, 0.0)), WHOLE) == []


def test_sources_of_all_kinds_share_a_batch():
    """Photons of many sources emitted together are those that each emits alone."""
    kinds = [lamp(kind, 3.0, size=(1, 0.5), radius=0.1, angle=0.5, position=(0, 0, 1 + kind)) for kind in LightKind]
    mesh = merge(plane(2.0), plane(0.5, z=1))
    lit = {"albedo": [0.5, 0.5], "emission": [0, 8.0], "material": [0, 0, 1, 1], "world": 0.5}
    sources = light_sources(scene_of(*mesh, lights=Lights.join(kinds), **lit), WHOLE)
    assert len(sources) == len(LightKind) + 2
    u, number = stream(5).random((700, N_DIMENSIONS), dtype=np.float32), np.arange(700, dtype=np.int32) % len(sources)
    together = emitted_by(sources, number, u)
    for k, source in enumerate(sources):
        alone = source.emit(u[number == k])
        for name in ("origins", "directions", "flux", "objects"):
            assert np.array_equal(getattr(together, name)[number == k], getattr(alone, name))


def test_emission_does_not_depend_on_how_it_is_chunked():
    source = source_of(lamp(LightKind.POINT, 1.0, radius=0.2))
    u = stream(5).random((100, N_DIMENSIONS), dtype=np.float32)
    whole, half = source.emit(u), source.emit(u[:50])
    assert np.array_equal(whole.origins[:50], half.origins) and np.array_equal(whole.flux[:50], half.flux)
