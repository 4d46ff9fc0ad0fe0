"""Where photons are aimed, at single numbers: densities against their sums in double precision, as plain Python."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.emitters import Sphere, bounding_sphere, light_sources, region_of
from photon_bake.addon.emitters.aiming import caustic_makers as makers
from photon_bake.addon.emitters.aiming import guided as guides
from photon_bake.addon.emitters.aiming import projection_map as maps
from photon_bake.addon.emitters.aiming import target_region as target
from photon_bake.addon.emitters.aiming.guided import Guide, guide_cells
from photon_bake.addon.emitters.aiming.projection_map import ProjectionMap, balls_of
from photon_bake.addon.emitters.emission import emit
from photon_bake.addon.emitters.source import emitters_of
from photon_bake.addon.scene import Channel, LightKind, Materials
from photon_bake.tests.core.bsdf_points import closures
from photon_bake.tests.core.scenes import ball, box, lamp, merge, of_objects, plane, scene_of
from photon_bake.tests.core.test_aiming import AIM, SOURCES
from photon_bake.tests.core.test_emission import source_of
from photon_bake.tests.core.values.lobe_formulas import NUMBERS, f, numbers, triple, unit
from photon_bake.tests.core.values.mixed_closures import CLEAR, METAL, WHITE_FLOOR

CENTRES = np.float32([(1, 0.2, 3), (0.4, -0.5, 2), (-0.7, 0.3, 2.5), (0, 0, 4)])
RADII = np.float32([0.3, 0.6, 0.5, 0.9])
MAPS = [ProjectionMap(CENTRES[:1], RADII[:1]), None, ProjectionMap(CENTRES[1:], RADII[1:])]


def cone(centre, radius, origin, reach=0.0):
    """Versine of half the angle of the cone of lines to a ball, and its axis."""
    way = np.float64(centre) - np.float64(origin)
    d = np.linalg.norm(way)
    sine = (float(radius) + reach) / d
    return (1 - np.sqrt(1 - sine**2) if sine < 1 else 2.0), way / d


# Projection maps


def test_cones_to_balls():
    for origin, reach in (((0, 0, 0), 0.0), ((0.3, -2, 1), 0.4), ((30, -200, 100), 0.1)):
        versine, axis = maps.cone_to_ball(triple(CENTRES[1]), RADII[1], triple(origin), reach)
        expected, way = cone(CENTRES[1], RADII[1], origin, reach)
        assert versine == pytest.approx(expected, rel=1e-6) and axis == pytest.approx(way, abs=1e-6)
    assert maps.cone_to_ball(triple(CENTRES[1]), RADII[1], triple(CENTRES[1] + 0.1), f(0))[0] == 2
    assert maps.cone_to_ball(triple(1), f(0.5), triple(1), f(0)) == (2, (0, 0, 1))
    assert maps.cone_to_ball(triple(0), f(0), triple((0, 0, 5)), f(0))[0] == 2.0**-41
    versines, axes = maps.cones_to_ball(CENTRES[0], 0.3, np.zeros((2, 3), np.float32), 0.2)
    expected, way = cone(CENTRES[0], 0.3, (0, 0, 0), 0.2)
    assert versines == pytest.approx([expected] * 2, rel=1e-6) and axes == pytest.approx(
        np.float32([way] * 2), abs=1e-6
    )


def test_balls_of_maps_are_kept_once():
    balls = balls_of([*MAPS, MAPS[0]])
    assert balls.start.tolist() == [0, 0, 1, 0] and balls.stop.tolist() == [1, 0, 4, 1]
    assert np.array_equal(balls.centre, CENTRES) and np.array_equal(balls.radius, RADII)
    assert maps.halved(balls, 1, f(0.3)) == (False, f(0.3))
    for u, aimed, left in ((0.2, True, 0.4), (0.5, False, 0.0), (0.7, False, 0.4)):
        assert maps.halved(balls, 2, f(u)) == (aimed, pytest.approx(left, abs=1e-6))


@pytest.mark.parametrize("source", [0, 2])
@pytest.mark.parametrize("aimed", [True, False])
def test_directions_are_parted_between_balls_and_the_rest(source, aimed):
    """Half of the photons by the mean density of the cones, half as they were but for those cones."""
    balls, origin, reach = balls_of(MAPS), (0.2, 0.1, -0.5), 0.1
    first, last = balls.start[source], balls.stop[source]
    cones = [cone(CENTRES[k], RADII[k], origin, reach) for k in range(first, last)]
    towards_ball = cones[0][1]
    for u, v in [*numbers(NUMBERS), (f(0.999), f(0.2))]:
        for plain in (unit(0.3, 0.2, -0.9), triple(towards_ball)):
            direction, per_density = maps.redirected(
                balls, source, aimed, u, v, triple(origin), f(reach), plain, f(7.5)
            )
            if aimed:
                chosen = min(int(u * (last - first)), last - first - 1)
                versine, axis = cones[chosen]
                within = u * (last - first) - chosen
                assert 1 - np.float64(direction) @ axis == pytest.approx(within * versine, rel=1e-2, abs=1e-6)
            else:
                assert direction == plain
            d = np.float64(direction)
            density = np.mean([(1 - d @ axis <= versine) / (2 * np.pi * versine) for versine, axis in cones])
            expected = 2 / density if aimed else (0 if density > 0 else 15)
            assert per_density == pytest.approx(expected, rel=1e-3)
    assert maps.redirected(balls, 1, aimed, u, v, triple(origin), f(reach), plain, f(7.5)) == (plain, 7.5)


@pytest.mark.parametrize("source", [0, 2])
@pytest.mark.parametrize("aimed", [True, False])
def test_places_are_parted_between_balls_and_the_rest(source, aimed):
    balls, direction = balls_of(MAPS), unit(0.2, 0.1, -0.9)
    first, last = balls.start[source], balls.stop[source]
    along = np.float64(direction)

    def aside(place, k):
        away = np.float64(place) - CENTRES[k]
        return np.linalg.norm(away - away @ along * along)

    for u, v in [*numbers(NUMBERS), (f(0.999), f(0.2))]:
        for plain in (triple((9, 9, 9)), triple(CENTRES[first] + 0.1)):
            place, per_density = maps.moved(balls, source, aimed, u, v, plain, direction, f(7.5))
            if aimed:
                chosen = min(int(u * (last - first)), last - first - 1)
                within, k = u * (last - first) - chosen, first + chosen
                assert aside(place, k) == pytest.approx(np.sqrt(within) * RADII[k], rel=1e-3, abs=1e-4)
                assert (np.float64(place) - CENTRES[k]) @ along == pytest.approx(0, abs=1e-5)
            else:
                assert place == plain
            inside = [(aside(place, k) <= RADII[k]) / (np.pi * float(RADII[k]) ** 2) for k in range(first, last)]
            density = np.mean(inside)
            expected = 2 / density if aimed else (0 if density > 0 else 15)
            assert per_density == pytest.approx(expected, rel=1e-3)
    assert maps.moved(balls, 1, aimed, u, v, plain, direction, f(7.5)) == (plain, 7.5)
    assert maps._parted(True, 0.0, f(3)) == 0


def place_of(source, photon):
    """Where a photon of an area lamp or a mesh starts, on the surface itself."""
    return photon[0] if len(source.surroundings.scene.lights) else (*photon[0][:2], f(1))


@pytest.mark.parametrize("name", ["point", "sphere", "spot", "area", "spread", "far area", "sun", "mesh"])
def test_aimed_sources_part_their_photons(name):
    """Aimed photons carry 2 L/p of the balls; others twice what they carry unaimed, or nothing towards a ball."""
    plain, source = source_of(**SOURCES[name]), source_of(**SOURCES[name])
    source.aim_at(AIM)
    assert source.n_cells == (*plain.n_cells[:4], max(2 * plain.n_cells[4], 2))
    emitters, unaimed = emitters_of([source]), emitters_of([plain])
    for u in np.random.default_rng(4).random((8, 5), dtype=np.float32):
        rest = emit(emitters, 0, *u[:4], f(0.5 + u[4] / 2))
        alone = emit(unaimed, 0, *u)
        assert rest[0] == pytest.approx(alone[0], abs=1e-4) and rest[1] == pytest.approx(alone[1], abs=1e-5)
        assert rest[2] == (0, 0, 0) or rest[2] == pytest.approx(np.multiply(alone[2], 2), rel=1e-3)
        aimed = emit(emitters, 0, *u[:4], f(u[4] / 2))
        origin, direction = np.float64(aimed[0]), np.float64(aimed[1])
        away = AIM.centre - origin
        across = np.linalg.norm(away - (away @ direction)[:, None] * direction, axis=1)
        assert (across <= AIM.radius + (0.61 if name == "sphere" else 1e-3)).any()
        balls, kind = emitters.balls, source.kind
        if kind == LightKind.SUN:
            place, _ = maps.moved(balls, 0, True, u[2], u[3], triple(0), aimed[1], f(1))
            aside = np.float64(place) - origin
            assert aside - aside @ direction * direction == pytest.approx(0, abs=1e-4)
        else:
            point = kind in (LightKind.POINT, LightKind.SPOT)
            start = emitters.lamps.position[0] if point else place_of(source, alone)
            reach = emitters.lamps.radius[0] if point else f(0)
            to, _ = maps.redirected(balls, 0, True, u[0], u[1], tuple(start), reach, triple(0), f(1))
            assert direction == pytest.approx(np.float64(to), abs=1e-4)


def test_small_caustic_makers_are_aimed_at_by_all_sampled_sources():
    glass = ball(0.3, (0.5, 0.2, 0.4), 2)
    mesh = merge(plane(2.0), glass)
    material = np.arange(len(mesh[1])) >= 2
    lights = lamp(LightKind.POINT, 2.0, position=(0, 0, 3))
    for radius, near, far in ((0.4, False, False), (0.7, True, False), (3.1, True, True)):
        scene = scene_of(*mesh, albedo=[0.5, 0], material=material, lights=lights, world=1.0)
        made = Materials.of(2, closures=replace(closures(WHITE_FLOOR, CLEAR), start=np.int32([0, 1, 2])))
        scene = of_objects(replace(scene, materials=made), material)
        sources = light_sources(scene, Sphere(np.zeros(3, np.float32), radius))
        assert [source.aim is not None for source in sources] == [near, False]
        sun = replace(lights, kind=np.int32([LightKind.SUN]))
        (source, _) = light_sources(replace(scene, lights=sun), Sphere(np.zeros(3, np.float32), radius))
        assert (source.aim is not None) == far


# Caustic makers


def test_only_objects_that_are_small_enough_are_aimed_at():
    """Also where a large one is the first of all."""
    large, small = ball(1.0, (3, 0, 0), 2), ball(0.1, (0.5, 0.2, 0.4), 2)
    which = np.repeat([0, 1], [len(large[1]), len(small[1])])
    scene = of_objects(scene_of(*merge(large, small)), which)
    scene = replace(scene, materials=Materials.of(1, closures=closures(CLEAR)))
    aim = makers.caustic_makers(scene, 0.5)
    assert len(aim.radius) == 1 and aim.centre[0] == pytest.approx((0.5, 0.2, 0.4), abs=1e-3)
    assert aim.radius[0] == pytest.approx(0.1, rel=1e-3) and len(makers.caustic_makers(scene, 1.1).radius) == 2


def test_balls_hold_their_corners():
    """Around the middle of each group's bounds."""
    corners = np.random.default_rng(1).normal(size=(9, 3, 3))
    group = np.array([2, 0, 1, 1, 0, 2, 2, 0, 1])
    centre, radius = makers._balls(corners, group)
    for k in range(3):
        of = corners[group == k].reshape(-1, 3)
        middle = (of.min(axis=0) + of.max(axis=0)) / 2
        assert centre[k] == pytest.approx(middle, abs=1e-5)
        assert radius[k] == pytest.approx(np.linalg.norm(of - middle, axis=1).max() * 1.0001, rel=1e-5)
    assert centre.dtype == radius.dtype == np.float32


def test_glass_and_sharp_metal_focus():
    """Metal of a reflectance of a fifth or more whose peak F/(4πα²) is 1 or more."""
    edge = (0.6 / (4 * np.pi)) ** 0.25  # α² = F/4π
    metal = METAL | {"weight": 0.75, "f0": (0.1, 0.8, 0.2)}
    several = [
        CLEAR | {"roughness": 0.9},
        metal | {"roughness": edge * 0.99},
        metal | {"roughness": edge * 1.01},
        METAL | {"weight": 0.5, "f0": 0.41, "roughness": 0.01},
        METAL | {"weight": 0.5, "f0": 0.39, "roughness": 0.01},
        WHITE_FLOOR,
    ]
    made = Materials.of(6, closures=replace(closures(*several), start=np.arange(7, dtype=np.int32)))
    scene = replace(scene_of(*box(), albedo=[0.5] * 6, material=np.arange(12) // 2), materials=made)
    assert makers._focuses(scene).tolist() == [True, True, False, True, False, False]
    aim = makers.caustic_makers(scene, 10.0)
    assert len(aim.radius) == 6  # an object each
    assert makers.caustic_makers(scene, 0.9) is None
    hidden = replace(scene, objects=replace(scene.objects, scatters=np.arange(12) == 1))
    assert len(makers.caustic_makers(hidden, 10.0).radius) == 1


def test_regions_are_around_most_receivers():
    positions = np.stack([np.linspace(0, 100, 101), np.linspace(-1, 1, 101), np.zeros(101)], axis=1)
    region = region_of(positions)
    assert region.centre == pytest.approx([50, 0, 0], abs=1e-5) and region.centre.dtype == np.float32
    assert region.radius == pytest.approx(np.hypot(96, 1.92) / 2)
    whole = bounding_sphere(scene_of(*plane(2.0, z=3.0)))
    assert whole.centre == pytest.approx([0, 0, 3]) and whole.radius == pytest.approx(np.sqrt(8) * 1.001)
    assert bounding_sphere(scene_of([(0, 0, 0)] * 3, [0, 1, 2])).radius == 1e-6


# Guides

DENSITY = np.random.default_rng(5).uniform(0.2, 2, (3, 2, 1, 2, 4))
DENSITY /= DENSITY.mean()


def test_guided_points_lie_in_cells_by_their_density():
    """The last number chooses the cell, and what is left of it and the others say where in it."""
    other = np.random.default_rng(6).uniform(0.2, 2, (1, 1, 2, 1, 3))
    cells = guide_cells([Guide.even(), Guide(other / other.mean()), Guide(DENSITY)])
    sums = np.cumsum(DENSITY.ravel()) / DENSITY.size
    seen = set()
    for u in np.random.default_rng(7).random((60, 5), dtype=np.float32):
        at, density = guides.guided(cells, 2, tuple(u))
        k = int(np.searchsorted(sums, u[4], side="right"))
        seen.add(k)
        cell = np.unravel_index(k, DENSITY.shape)
        assert density == pytest.approx(DENSITY[cell], rel=1e-5)
        within = [*u[:4], (u[4] - (sums[k] - DENSITY[cell] / DENSITY.size)) * DENSITY.size / DENSITY[cell]]
        expected = (np.array(cell) + within) / DENSITY.shape
        assert at == pytest.approx(expected, abs=1e-4) and max(at) < 1
    assert len(seen) > 25
    u = tuple(numbers(NUMBERS)[0]) * 2 + (f(0.4),)
    assert guides.guided(cells, 0, u) == (u, 1)
    k = np.searchsorted(np.cumsum(other.ravel() / other.sum()), 0.4)
    assert guides.guided(cells, 1, u)[1] == pytest.approx(other.ravel()[k] / other.mean(), rel=1e-5)
    last = guides.guided(cells, 2, (f(1 - 2**-24),) * 5)
    assert max(last[0]) < 1 and last[1] == pytest.approx(DENSITY.ravel()[-1], rel=1e-5)
    at, density = guides.guided(cells, 2, (f(0),) * 5)
    assert at == (0, 0, 0, 0, 0) and density == pytest.approx(DENSITY.ravel()[0], rel=1e-5)


def test_cells_of_several_guides():
    cells = guide_cells([Guide.even(), Guide(DENSITY)])
    n = DENSITY.size
    assert cells.start.tolist() == [0, 1, 1 + n] and cells.shape.tolist() == [[1] * 5, list(DENSITY.shape)]
    assert cells.cumulative == pytest.approx([1, *np.cumsum(DENSITY.ravel()) / n]) and cells.density[0] == 1
    starts = np.arange(n) / n * cells.cumulative[-1]
    assert cells.cutpoints[1:].tolist() == (1 + np.searchsorted(cells.cumulative[1:], starts, side="right")).tolist()


# The region


@pytest.mark.parametrize("origin", [(3.0, 1, 2), (0.4, 0.1, 1.2)])
def test_halves_of_photons_that_go_to_the_region(origin):
    """By octaves of the versine from the region's own cone on, where it is two radii away or more."""
    centre, radius = np.array([0.3, 0.2, -0.1]), 0.8
    narrow, axis = cone(centre, radius, origin)
    far = np.linalg.norm(np.array(origin) - centre) > 2 * radius
    for u, v in numbers(NUMBERS):
        towards = target.towards_region(triple(centre), f(radius), u, triple(origin))
        assert towards.far == far and towards.goes == (far and u < 0.5)
        assert towards.u == pytest.approx((u if not far else 2 * u if u < 0.5 else 2 * u - 1), abs=1e-6)
        assert towards.versine == pytest.approx(narrow, rel=1e-5) and towards.axis == pytest.approx(axis, abs=1e-6)
        for w in (unit(0.3, 0.1, 0.8), triple(axis), unit(-0.9, -0.2, -0.5)):
            versine, unaimed = 1 - np.float64(w) @ axis, 0.13
            octaves = 1 / (2 * np.pi * (narrow + versine) * np.log(1 + 2 / narrow))
            own, other = (octaves, unaimed) if towards.goes else (unaimed, octaves)
            expected = 1 / unaimed if not far else 2 / own if own >= other else 0
            assert target.per_density_towards(towards, w, f(unaimed)) == pytest.approx(expected, rel=1e-3)
        if towards.goes:
            d = np.float64(target.aimed_direction(towards, v))
            expected = narrow * ((1 + 2 / narrow) ** (2 * u) - 1)
            assert 1 - d @ axis == pytest.approx(expected, rel=1e-3, abs=1e-6)
    assert not target.towards_region(triple(centre), f(0), f(0.3), triple(origin)).far
    edge = triple(centre + np.array([0, 0, 1.6001]))
    assert target.towards_region(triple(centre), f(radius), f(0.3), edge).far
    assert not target.towards_region(triple(centre), f(radius), f(0.3), triple(centre + np.array([0, 0, 1.599]))).far
    assert target.towards_region(triple(centre), f(1e-9), f(0.3), triple((900, 0, 0))).versine == 1e-12


def test_channels_of_materials_stay_as_they_are():
    """What is aimed at does not depend on colours of closures that scatter nothing."""
    none = Channel.constant(np.zeros((1, 3), np.float32))
    assert makers.caustic_makers(replace(scene_of(*box()), materials=Materials.of(1, diffuse=none)), 1.0) is None
