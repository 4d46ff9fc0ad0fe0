"""Photons of every source at single points of its hypercube: direction, place and flux, as plain Python."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.core.sampling.sobol import fixed_points
from photon_bake.addon.core.sampling.warps import at_versine
from photon_bake.addon.core.vec3 import to_world
from photon_bake.addon.emitters import Sphere, area, light_sources, row, world
from photon_bake.addon.emitters.aiming.discs import discs_around
from photon_bake.addon.emitters.emission import emit_rays
from photon_bake.addon.emitters.source import emitters_of
from photon_bake.addon.scene import LightKind, LightPattern, Lights, RayKind, World
from photon_bake.tests.core.scenes import lamp, plane, scene_of
from photon_bake.tests.core.test_emission import source_of
from photon_bake.tests.core.values.emitters.one_photon import POINTS, emitted
from photon_bake.tests.core.values.emitters.test_lamps import AXIS, CENTRE, PLACE, X, Y, slats, spot_share
from photon_bake.tests.core.values.lobe_formulas import (
    triple,
)

REGION = Sphere(np.float32([0.3, 0.2, 0.1]), 0.5)


def of(kind, emission=(3, 2, 1), **columns):
    return source_of(lamp(kind, emission, **PLACE | columns))


def versine_of(position, radius=0.0, half=2.0):
    """Of the cone around the scene, a square: 1 − cos arcsin((R + r)/d)."""
    whole = np.hypot(half, half) * 1.001
    return 1 - np.sqrt(1 - ((whole + radius) / np.linalg.norm(position)) ** 2)


FAR = np.array([12.0, -15.0, 20.0])
TO_SCENE = -FAR / np.linalg.norm(FAR)


# Lamps


@pytest.mark.parametrize("sphere", [False, True])
@pytest.mark.parametrize("position", [CENTRE, FAR])
def test_photons_of_point_lamps(sphere, position):
    """Even in the cone around the scene, I dω each, from a disc across the way or the half of a ball."""
    source = of(LightKind.POINT, radius=0.3, sphere=sphere, position=position)
    versine, axis = (2.0, None) if position is CENTRE else (versine_of(FAR, 0.3), TO_SCENE)
    power = 2 * np.pi * versine * np.array([3, 2, 1])
    assert source.power == pytest.approx(power, rel=1e-5) and source.importance == pytest.approx(power.sum(), rel=1e-5)
    assert source.row.aims == (position is FAR) and source.n_cells == (64, 64, 1, 1, 1)
    for u, origin, direction, flux, object_ in emitted(source):
        assert flux == pytest.approx(power, rel=1e-5) and object_ == -1
        offset = origin - position
        assert np.hypot(*(offset - offset @ direction * direction)[:2]) <= 0.301
        across = np.linalg.norm(offset - offset @ direction * direction)
        assert across == pytest.approx(0.3 * np.sqrt(u[2]), abs=2e-5)
        assert offset @ direction == pytest.approx(0.3 * np.sqrt(1 - u[2]) if sphere else 0, abs=2e-5)
        expected = to_world(at_versine(u[0] * versine, u[1]), triple((0, 0, 1)) if axis is None else triple(axis))
        if axis is not None:
            assert direction == pytest.approx(np.float64(expected), abs=1e-5)


@pytest.mark.parametrize("stretch", [(1, 1), (1.5, 0.7)])
def test_photons_of_spots(stretch):
    """Even in the round cone, then stretched: dω grows by ab/|(ax, by, z)|³."""
    source, edge = of(LightKind.SPOT, angle=1.1, blend=0.6, stretch=stretch), 1 - np.cos(0.55)
    assert source.row.versine == pytest.approx(edge) and not source.row.aims
    for u, origin, direction, flux, _ in emitted(source):
        local = np.array([direction @ X / stretch[0], direction @ Y / stretch[1], direction @ AXIS])
        local /= np.linalg.norm(local)
        assert 1 - local[2] == pytest.approx(u[0] * edge, rel=1e-3, abs=1e-6)
        azimuth = np.arctan2(local[1], local[0]) / (2 * np.pi) % 1
        assert azimuth == pytest.approx(u[1], abs=1e-3)
        size = np.linalg.norm([stretch[0] * local[0], stretch[1] * local[1], local[2]])
        expected = 2 * np.pi * edge * np.prod(stretch) / size**3 * spot_share(direction, stretch=stretch)
        assert flux == pytest.approx(expected * np.array([3, 2, 1]), rel=2e-3, abs=1e-5)
        assert origin == pytest.approx(CENTRE, abs=1e-6)


def test_photons_of_far_spots_fly_to_the_scene():
    source = of(LightKind.SPOT, angle=1.1, blend=0.6, position=FAR, direction=TO_SCENE, radius=0.2)
    versine, lights = versine_of(FAR, 0.2), source.surroundings.scene.lights
    assert source.row.aims and source.row.versine == pytest.approx(versine, rel=1e-5)
    x, y = lights.axis_x[0], lights.axis_y[0]
    for u, _, direction, flux, _ in emitted(source):
        assert 1 - direction @ TO_SCENE == pytest.approx(u[0] * versine, rel=1e-3, abs=1e-6)
        t = np.clip((direction @ TO_SCENE - np.cos(0.55)) / (0.6 * (1 - np.cos(0.55))), 0, 1)
        assert flux == pytest.approx(2 * np.pi * versine * t * t * (3 - 2 * t) * np.array([3, 2, 1]), rel=1e-4)
        assert abs(direction @ x) < 0.3 and abs(direction @ y) < 0.3
    measured = np.mean([flux for *_, flux, _ in emitted(source, fixed_points(64, 5))], axis=0)
    assert source.power == pytest.approx(measured, rel=1e-5)


@pytest.mark.parametrize(("kind", "spread"), [(3, np.pi), (4, np.pi), (3, 2.2)])
def test_photons_of_area_lamps(kind, spread):
    """Cosine-weighted within the spread, from a place uniform by area: π L A sin² h times the slats' share."""
    source = of(LightKind(kind), (1, 2, 5), size=(0.6, 1.1), spread=spread)
    size = 0.66 * (np.pi / 4 if kind == LightKind.ELLIPSE else 1)
    sin2 = 1 if spread == np.pi else np.sin(1.1) ** 2
    assert source.power == pytest.approx(np.pi * size * np.array([1, 2, 5]), rel=1e-5)
    lamps = source.surroundings.lamps
    for u, origin, direction, flux, _ in emitted(source):
        assert origin == pytest.approx(np.float64(area.place_on_area(lamps, 0, u[2], u[3])), abs=1e-6)
        cos = direction @ AXIS
        assert 1 - cos**2 == pytest.approx(u[0] * sin2, rel=1e-3, abs=1e-5)
        share = slats(direction) if spread < np.pi else 1
        assert flux == pytest.approx(np.pi * sin2 * size * share * np.array([1, 2, 5]), rel=2e-3, abs=1e-4)


def test_photons_of_far_area_lamps_fly_to_the_scene():
    source = of(LightKind.RECTANGLE, (1, 2, 5), size=(0.6, 1.1), position=FAR, direction=TO_SCENE + 0.2 * X)
    reach, lights = np.hypot(0.6, 1.1) / 2, source.surroundings.scene.lights
    assert source.row.aims and source.row.versine == pytest.approx(versine_of(FAR, reach), rel=1e-5)
    for u, origin, direction, flux, _ in emitted(source):
        assert np.linalg.norm(origin - FAR) < reach
        versine, to = versine_of(origin), -origin / np.linalg.norm(origin)
        assert 1 - direction @ to == pytest.approx(u[0] * versine, rel=1e-3, abs=1e-6)
        cos = direction @ lights.direction[0]
        assert flux == pytest.approx(0.66 * cos * 2 * np.pi * versine * np.array([1, 2, 5]), rel=1e-3)


def test_wide_area_lamps_do_not_aim():
    """The cone around the scene has to be narrower than their own: 2(1 − cos) < sin² h."""
    far = {"size": (0.6, 1.1), "position": FAR, "direction": TO_SCENE}
    reach = np.hypot(0.6, 1.1) / 2
    limit = 2 * np.arcsin(np.sqrt(2 * versine_of(FAR, reach)))
    for spread, aims in ((limit * 0.99, False), (limit * 1.01, True)):
        source = of(LightKind.RECTANGLE, spread=spread, **far)
        assert source.row.aims == aims and (source.row.power is None) == aims


# Parallel light


def area_by_discs(discs, origin, direction):
    """1 over Σ [the line meets disc k]/(K π R_k²), of the discs around the region and the one around the scene."""
    k, density = len(discs.radii) + 1, 0.0
    for centre, radius in [*((discs.region, r) for r in discs.radii), (discs.whole, discs.whole_radius)]:
        away = np.float64(centre) - origin
        if np.linalg.norm(away - away @ direction * direction) < radius:
            density += 1 / (k * np.pi * float(radius) ** 2)
    return 1 / density


def test_discs_around_a_region():
    """Each twice as wide as the one before, up to the scene; sums of 1/(K A)."""
    scene = scene_of(*plane(2.0))
    discs, whole = discs_around(scene, REGION), np.hypot(2, 2) * 1.001
    assert discs.radii == pytest.approx([0.5, 1.0, 2.0]) and discs.whole_radius == pytest.approx(whole)
    areas = 4 * np.pi * np.array([0.5, 1.0, 2.0]) ** 2
    assert discs.density == pytest.approx([(1 / areas).sum(), (1 / areas[1:]).sum(), 1 / areas[2], 0], rel=1e-5)
    assert discs.density_of_whole == pytest.approx(1 / (4 * np.pi * whole**2), rel=1e-5)
    assert discs.area_of_region == pytest.approx(np.pi / 4) and discs.region_radius == 0.5
    assert discs.region == pytest.approx(REGION.centre) and discs.whole == pytest.approx((0, 0, 0))
    point = discs_around(scene, Sphere(REGION.centre, 0.0))
    assert point.radii[0] == pytest.approx(1e-6 * whole, rel=1e-4) and len(point.radii) == 20
    assert len(discs_around(scene, Sphere(REGION.centre, 9.0)).radii) == 0


@pytest.mark.parametrize("region", [REGION, Sphere(np.float32([3.0, 0, 0]), 0.4), Sphere(np.zeros(3, np.float32), 9.0)])
def test_photons_of_suns(region):
    source = source_of(lamp(LightKind.SUN, (1, 2, 3), angle=0.4, direction=AXIS), region=region)
    discs, versine = source.surroundings.discs, 1 - np.cos(0.2)
    beam = np.array([1, 2, 3]) * 2 / (1 + np.cos(0.2))
    assert source.power == pytest.approx(beam * discs.area_of_region, rel=1e-5)
    assert source.n_cells == (1, 1, 64, 64, len(discs.radii) + 1) and source.row.versine == pytest.approx(versine)
    for u, origin, direction, flux, _ in emitted(source):
        expected = to_world(at_versine(u[0] * versine, u[1]), triple(AXIS))
        assert direction == pytest.approx(np.float64(expected), abs=1e-5)
        assert flux == pytest.approx(beam * area_by_discs(discs, origin, direction), rel=1e-3)
        back = (np.float64(discs.whole) - origin) @ direction
        assert back == pytest.approx(discs.whole_radius, rel=1e-4)
        chosen = min(int(u[4] * (len(discs.radii) + 1)), len(discs.radii))
        inner = chosen < len(discs.radii)
        away = origin - np.float64(discs.region if inner else discs.whole)
        radius = discs.radii[chosen] if inner else discs.whole_radius
        expected = np.sqrt(u[2]) * radius
        assert np.linalg.norm(away - away @ direction * direction) == pytest.approx(expected, rel=1e-3, abs=1e-4)


IMAGE = np.random.default_rng(1).uniform(0.1, 1, (4, 8, 3)).astype(np.float32)


@pytest.mark.parametrize("image", [None, IMAGE])
def test_photons_of_worlds(image):
    """L over the density of its direction, times the area that its place stands for."""
    of_world = World(np.float32([0.5, 1, 2]), image, frozenset({RayKind.GLOSSY}))
    scene = replace(scene_of(*plane(2.0)), world=of_world)
    (source,) = light_sources(scene, REGION)
    discs, arrays = source.surroundings.discs, world.world_arrays(of_world)
    assert world.world_arrays(of_world) is arrays and arrays.height == (0 if image is None else 4)
    assert source.name == "World" and source.kind == row.WORLD and source.lamp == -1
    assert source.power == pytest.approx(of_world.integral * np.pi / 4, rel=1e-5)
    assert source.sampled_directly == (image is not None)
    assert not source.seen_by(RayKind.GLOSSY) and source.seen_by(RayKind.DIFFUSE)
    assert source.n_cells == (8, 8, 8, 8, 4)
    weights = None if image is None else (image * of_world.color).mean(axis=2)
    for u, origin, direction, flux, _ in emitted(source):
        towards = -direction
        if image is None:
            radiance, density = of_world.color, 1 / (4 * np.pi)
            assert 1 - towards[2] == pytest.approx(2 * u[0], abs=1e-5)
        else:
            line = int(np.arccos(-towards[2]) / np.pi * 4)
            column = int((0.5 - np.arctan2(towards[1], towards[0]) / (2 * np.pi)) * 8)
            radiance = of_world.color * image[line, column]
            whole = (weights * of_world.solid_angles[:, None]).sum()
            density = weights[line, column] / whole
        seen, pdf = world.world_towards(arrays, triple(towards))
        assert seen == pytest.approx(radiance, rel=1e-5) and pdf == pytest.approx(density, rel=1e-4)
        assert flux == pytest.approx(radiance / density * area_by_discs(discs, origin, direction), rel=1e-3)
        assert world.world_seen(arrays, triple(towards), int(RayKind.GLOSSY)) == (0, 0, 0)
        assert world.world_seen(arrays, triple(towards), int(RayKind.DIFFUSE)) == pytest.approx(radiance, rel=1e-5)
    hidden = replace(scene, world=World(of_world.color, None, frozenset({RayKind.DIFFUSE})))
    assert light_sources(hidden, REGION)[0].sampled_directly


# All of them


def test_lamps_with_a_pattern_are_sources_of_their_own_kind():
    assert sorted({*map(int, LightKind), row.MESH, row.WORLD, row.PATTERN}) == list(range(len(LightKind) + 3))
    for kind, columns in ((LightKind.POINT, {}), (LightKind.RECTANGLE, {"size": (0.6, 1.1)})):
        lights = lamp(kind, (3, 2, 1), **PLACE | columns)
        half = replace(lights, patterns=(LightPattern(np.full((4, 8, 3), 0.5, np.float32)),))
        plain, dimmed = source_of(lights), source_of(half)
        assert dimmed.kind == row.PATTERN and plain.kind == kind
        assert dimmed.power == pytest.approx(0.5 * plain.power, rel=0.05)


def test_sources_know_their_lamps():
    lights = Lights.join([lamp(kind, 2.0, angle=0.4, size=(1, 0.5), name=kind.name, **PLACE) for kind in LightKind])
    n, linked = len(LightKind), np.eye(len(LightKind), 2, dtype=bool)
    seen, numbers = np.arange(n) < 3, np.arange(n)
    lights = replace(lights, illuminates=linked, blocked_by=~linked, max_bounces=numbers, seen_in_gloss=seen)
    sources = light_sources(scene_of(*plane(2.0), lights=lights, emission=1.0), REGION)
    assert [source.name for source in sources] == [*(kind.name for kind in LightKind), "Emissive meshes"]
    assert [source.lamp for source in sources] == list(range(n + 1)) and sources[n].kind == row.MESH
    for k, source in enumerate(sources[:n]):
        assert source.kind == k and source.max_bounces == k and source.sampled_directly
        assert source.illuminates.tolist() == linked[k].tolist() and source.blocked_by.tolist() == (~linked[k]).tolist()
        assert source.seen_by(RayKind.GLOSSY) == (k < 3) and source.aim is None
        assert source.importance == pytest.approx(source.power.sum())
    assert sources[n].illuminates is None and sources[n].max_bounces == 1024
    u = POINTS[: n + 1]
    rays = [source.emit(u) for source in sources]
    found = [np.empty((n + 1, 3), np.float32) for _ in range(3)]
    objects = np.empty(n + 1, np.int32)
    emit_rays(emitters_of(sources), np.arange(n + 1, dtype=np.int32), u, *found, objects)
    for k in range(n + 1):
        for name, column in zip(("origins", "directions", "flux"), found, strict=True):
            assert np.array_equal(getattr(rays[k], name)[k], column[k])
        assert rays[k].objects[k] == objects[k]


@pytest.mark.parametrize(("power", "smoothing"), [(1, 0.0), (2, 0.0), (0, 3.0)])
def test_importance_goes_by_what_is_left_where_receivers_are(power, smoothing):
    plain = of(LightKind.POINT)
    fading = of(LightKind.POINT, distance_power=power, smoothing=smoothing)
    away = max(np.linalg.norm(CENTRE), 3.0)
    left = away**power * (away**2 / (smoothing + away**2))
    assert fading.importance / plain.importance == pytest.approx(left, rel=1e-4)
    far = {"position": FAR}
    away = np.linalg.norm(FAR)
    left = away**power * (away**2 / (smoothing + away**2))
    fading = of(LightKind.POINT, distance_power=power, smoothing=smoothing, **far)
    assert fading.importance / of(LightKind.POINT, **far).importance == pytest.approx(left, rel=1e-4)
