"""Photons and points of emissive meshes at single numbers, as plain Python."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.core.sampling.sobol import fixed_points
from photon_bake.addon.core.sampling.warps import cosine_hemisphere, sample_uniform_triangle, uniform_triangle
from photon_bake.addon.emitters import Sphere, light_sources, mesh
from photon_bake.addon.emitters.emission import emit
from photon_bake.addon.emitters.source import Surroundings, emitters_of
from photon_bake.addon.scene import Channel, RayKind, Textures
from photon_bake.addon.scene.hit import point_at, ray_offset
from photon_bake.tests.core.scenes import lamp, merge, of_objects, plane, scene_of
from photon_bake.tests.core.test_emission import source_of
from photon_bake.tests.core.values.emitters.test_lamps import PLACE
from photon_bake.tests.core.values.lobe_formulas import (
    f,
    triple,
)

POINTS = np.random.default_rng(3).random((14, 5), dtype=np.float32)
REGION = Sphere(np.float32([0.3, 0.2, 0.1]), 0.5)


def emitted(source, points=POINTS):
    """Origin, direction, flux and object of each point's photon, in double precision."""
    emitters = emitters_of([source])
    for u in points:
        origin, direction, flux, object_ = emit(emitters, 0, *u)
        assert np.linalg.norm(direction) == pytest.approx(1, abs=1e-5)
        yield u, np.float64(origin), np.float64(direction), np.float64(flux), object_


def of(kind, emission=(3, 2, 1), **columns):
    return source_of(lamp(kind, emission, **PLACE | columns))


def versine_of(position, radius=0.0, half=2.0):
    """Of the cone around the scene, a square: 1 − cos arcsin((R + r)/d)."""
    whole = np.hypot(half, half) * 1.001
    return 1 - np.sqrt(1 - ((whole + radius) / np.linalg.norm(position)) ** 2)


FAR = np.array([12.0, -15.0, 20.0])
TO_SCENE = -FAR / np.linalg.norm(FAR)


GLOW = np.array([[3.0, 1, 2], [0.5, 4, 1]])
SIZES = np.array([2.0, 2.0, 0.125, 0.125])  # m²


AROUND = Sphere(np.zeros(3, np.float32), 3.0)


def glowing(both=True):
    """Two squares of an object each; the back of the second's material is black unless `both`."""
    scene = scene_of(*merge(plane(1.0), plane(0.25, z=1)), albedo=[0] * 3, material=[0, 0, 1, 1])
    emission = Channel.constant(np.float32([*GLOW, 0 * GLOW[0]]))
    seen_as = np.int32([[0] * 12, [1, 1 if both else 2] * 6, [2] * 12])
    materials = replace(scene.materials, emission=emission, seen_as=seen_as)
    return of_objects(replace(scene, materials=materials), [0, 0, 1, 1])


def chances(arrival, both=True):
    """Of the four triangles, by half their power, half what arrives, and a tenth by objects."""
    power = SIZES * GLOW.sum(axis=1)[[0, 0, 1, 1]] * ([1] * 4 if both else [1, 1, 0.5, 0.5])
    by_power = power / power.sum()
    by_arrival = by_power * arrival / (by_power * arrival).sum()
    return 0.9 * (by_power + by_arrival) / 2 + 0.1 * np.array([0.25] * 4)


@pytest.mark.parametrize("both", [True, False])
def test_photons_of_emissive_meshes(both):
    """One of four triangles by its chance, a side, cosine-weighted: π L A over the chance and the side's share."""
    scene, region = glowing(both), AROUND
    (source,) = light_sources(scene, region)
    assert source.name == "Emissive meshes" and source.n_cells == (32, 2, 1, 1, 256) and source.sampled_directly
    arrays = source.surroundings.mesh
    of_side = 2 * np.pi * GLOW * [[4], [0.25]] * [[1], [1 if both else 0.5]]
    assert source.power == pytest.approx(of_side.sum(axis=0), rel=1e-5) and source.seen_by(RayKind.GLOSSY)
    chance = chances(np.ones(4), both)
    assert arrays.density == pytest.approx(chance / SIZES, rel=1e-4)
    assert arrays.area == pytest.approx(SIZES / chance, rel=1e-4)
    assert arrays.front.tolist() == [0.5, 0.5, *[0.5 if both else 1.0] * 2]
    for u, origin, direction, flux, object_ in emitted(source):
        back = u[4] >= 0.5
        k = np.searchsorted(np.cumsum(chance), 2 * u[4] - back, side="right")
        up = not back or (k >= 2 and not both)
        assert object_ == k // 2 and (direction[2] > 0) == up
        share = 1.0 if k >= 2 and not both else 0.5
        assert flux == pytest.approx(np.pi * SIZES[k] / chance[k] / share * GLOW[k // 2], rel=1e-4)
        local = np.float64(cosine_hemisphere(u[0], u[1]))
        assert abs(direction[2]) == pytest.approx(local[2], abs=1e-5)
        a, b = uniform_triangle(u[2], u[3])
        place = np.float64(point_at(scene.arrays, k, a, b))
        lift = ray_offset(scene.arrays, k, triple(place)) * (1 if up else -1)
        assert origin == pytest.approx(place + np.array([0, 0, lift]), abs=1e-7)


def test_photons_of_meshes_far_from_the_region():
    """Half of the photons towards it; each direction is left to that half which finds it more often."""
    scene = glowing()
    region = Sphere(np.float32([3, 2, 30]), 1.0)
    (source,) = light_sources(scene, region)
    corners = scene.vertices[scene.triangles].astype(np.float64)
    centre = corners.mean(axis=1)
    reach = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    sine2 = (1 / (np.linalg.norm(centre - region.centre, axis=1) - reach)) ** 2
    chance = chances((1 - np.sqrt(1 - sine2)) / 2)
    assert source.surroundings.mesh.density == pytest.approx(chance / SIZES, rel=1e-4)
    halves = set()
    for u, origin, direction, flux, object_ in emitted(source, np.random.default_rng(8).random((40, 5), np.float32)):
        k = np.searchsorted(np.cumsum(chance), 2 * u[4] - (u[4] >= 0.5), side="right")
        way = region.centre - origin
        d = np.linalg.norm(way)
        narrow = 1 - np.sqrt(1 - 1 / d**2)
        versine = 1 - direction @ way / d
        by_cosine = abs(direction[2]) / (2 * np.pi)
        by_region = 1 / (2 * np.pi * (narrow + versine) * np.log(1 + 2 / narrow))
        goes = u[0] < 0.5
        own, other = (by_region, by_cosine) if goes else (by_cosine, by_region)
        halves.add((bool(goes), bool(own >= other)))
        density = own / 2 if own >= other else np.inf
        expected = abs(direction[2]) / density * SIZES[k] / chance[k] * GLOW[k // 2]
        assert flux == pytest.approx(expected, rel=2e-2, abs=1e-6) and object_ == k // 2
        if goes:
            assert versine == pytest.approx(narrow * ((1 + 2 / narrow) ** (2 * u[0]) - 1), rel=1e-2, abs=1e-5)
    assert {(True, True), (False, True), (False, False)} <= halves


def test_meshes_close_to_a_small_region():
    """What is nearer than its radius counts as if it were there: half of all directions."""
    scene, region = glowing(), Sphere(np.float32([0.3, 0.1, 1.5]), 0.2)
    corners = scene.vertices[scene.triangles].astype(np.float64)
    centre = corners.mean(axis=1)
    reach = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    nearest = np.maximum(np.linalg.norm(centre - region.centre, axis=1) - reach, 0.2)
    chance = chances((1 - np.sqrt(1 - (0.2 / nearest) ** 2)) / 2)
    assert (nearest == 0.2).any() and (nearest > 0.2).any()
    assert Surroundings.of(scene, region).mesh.density == pytest.approx(chance / SIZES, rel=1e-4)


def test_points_of_emissive_meshes():
    """L over the density by solid angle, d² p/|cos θ'|, which meets say as well."""
    scene, region = glowing(False), AROUND
    (source,) = light_sources(scene, region)
    arrays, of_scene, chance = source.surroundings.mesh, scene.arrays, chances(np.ones(4), False)
    for position in (triple((0.2, -0.3, 0.6)), triple((0.4, 0.1, 1.7))):
        for choice, u, v, *_ in POINTS:
            target, way, light, density, emitter = mesh.sample_mesh(of_scene, arrays, position, choice, u, v)
            k = np.searchsorted(np.cumsum(chance), choice, side="right")
            assert emitter == k // 2 and target == point_at(of_scene, k, *uniform_triangle(u, v))
            to = np.float64(target) - np.float64(position)
            d = np.linalg.norm(to)
            assert way == pytest.approx(to / d, abs=1e-5)
            expected = d**3 * chance[k] / SIZES[k] / abs(to[2])
            assert density == pytest.approx(expected, rel=1e-3)
            met = mesh.mesh_density(arrays, k, f(d), f(abs(to[2]) / d))
            assert met == pytest.approx(expected, rel=1e-4)
            dark = k >= 2 and to[2] > 0
            assert light == pytest.approx([0] * 3 if dark else GLOW[k // 2] / expected, rel=1e-3)
    level = triple((0.5, 0.3, 0))
    *_, light, density, _ = mesh.sample_mesh(of_scene, arrays, level, f(0.1), f(0.3), f(0.4))
    assert light == (0, 0, 0) or density > 0
    none = Surroundings.of(scene_of(*plane()), region).mesh
    assert mesh.mesh_density(none, 0, f(1), f(1)) == 0 and len(none.density) == 0


def test_what_emissive_meshes_light():
    scene = glowing()
    arrays = scene.arrays
    assert mesh.lights_up(arrays, 0, 1)
    linked = arrays._replace(link_group=np.int32([0, -1]), illuminates=np.array([[False, True]]))
    for emitter, object_, lit in ((0, 0, False), (0, 1, True), (1, 0, True), (0, -1, True), (-1, 0, True)):
        assert mesh.lights_up(linked, emitter, object_) == lit


def test_meshes_that_shine_from_their_back_alone():
    scene = scene_of(*plane(1.0), albedo=[0] * 2, emission=[0.0, 2.0])
    seen_as = np.int32([[0, 1] * 6, [1] * 12])
    scene = replace(scene, materials=replace(scene.materials, seen_as=seen_as))
    (source,) = light_sources(scene, AROUND)
    assert source.surroundings.mesh.front.tolist() == [0, 0] and source.power == pytest.approx([8 * np.pi] * 3)
    for _, _, direction, flux, _ in emitted(source):
        assert direction[2] < 0 and flux == pytest.approx([8 * np.pi] * 3, rel=1e-4)


def test_objects_without_power_get_no_photons():
    scene = glowing()
    covered = replace(scene.materials, coverage=Channel.constant(np.float32([1, 0, 1])))
    (source,) = light_sources(replace(scene, materials=covered), AROUND)
    assert source.surroundings.mesh.density == pytest.approx([0.25, 0.25, 0, 0])
    assert all(object_ == 0 for *_, object_ in emitted(source))


def test_textured_triangles_by_their_mean_and_their_brightest():
    """Nine tenths by the mean of points, a tenth by what they could be at the most."""
    picture = np.random.default_rng(4).uniform(0, 1, (3, 5, 3)).astype(np.float32) ** 3
    other = np.ones((2, 2, 3), np.float32)
    scene = glowing()
    texture = np.int32([-1, 1, -1])
    emission = Channel(scene.materials.emission.value, texture)
    materials = replace(scene.materials, emission=emission, textures=Textures.pack([other, picture]))
    triangles, chance, power = mesh.emissive_triangles(replace(scene, materials=materials))
    u, v = sample_uniform_triangle(fixed_points(32))  # as many as two triangles get of 64
    expected = 2 * np.pi * SIZES[:, None] * GLOW[[0, 0, 1, 1]]
    for k in (2, 3):
        uvs = scene.corner_uvs[k]
        at = (1 - u - v)[:, None] * uvs[0] + u[:, None] * uvs[1] + v[:, None] * uvs[2]
        column, line = (((at - np.floor(at)) * [5, 3]).astype(int)).T
        expected[k] *= picture[line, column].mean(axis=0)
    assert triangles.tolist() == [0, 1, 2, 3] and power == pytest.approx(expected, rel=1e-4)
    bound = 2 * np.pi * SIZES[:, None] * GLOW[[0, 0, 1, 1]] * np.array([[1] * 3] * 2 + [picture.max(axis=(0, 1))] * 2)
    of_bound = bound.sum(axis=1) / bound.sum()
    assert chance == pytest.approx(0.9 * expected.sum(axis=1) / expected.sum() + 0.1 * of_bound, rel=1e-4)
    cut = replace(materials, emission=scene.materials.emission, coverage=Channel(np.ones((3, 3), np.float32), texture))
    _, _, power = mesh.emissive_triangles(replace(scene, materials=cut))
    assert power[:2] == pytest.approx(2 * np.pi * SIZES[:2, None] * GLOW[0], rel=1e-5)
    assert power[2, 0] < 0.6 * 2 * np.pi * SIZES[2] * GLOW[1, 0]
    assert mesh._brightest(replace(scene, materials=materials))[1] == pytest.approx(GLOW[1] * picture.max(axis=(0, 1)))


def test_coverage_and_light_that_is_taken_away():
    """Radiance goes by the coverage, power by |L|, and hidden or black triangles are none."""
    scene, region = glowing(), AROUND
    covered = replace(scene.materials, coverage=Channel.constant(np.float32([0.25, 1, 1])))
    triangles, chance, power = mesh.emissive_triangles(replace(scene, materials=covered))
    expected = 2 * np.pi * SIZES[:, None] * GLOW[[0, 0, 1, 1]] * np.array([0.25, 0.25, 1, 1])[:, None]
    assert triangles.tolist() == [0, 1, 2, 3] and power == pytest.approx(expected, rel=1e-5)
    assert chance == pytest.approx(expected.sum(axis=1) / expected.sum(), rel=1e-5)
    found = mesh.radiance_of(replace(scene, materials=covered).arrays, np.int32([0, 2]), *np.float32([[0.2] * 2] * 2))
    assert found == pytest.approx(np.float32([0.25 * GLOW[0], GLOW[1]]))
    negative = replace(scene.materials, emission=Channel.constant(np.float32([-GLOW[0], GLOW[1], 0 * GLOW[0]])))
    _, chance, power = mesh.emissive_triangles(replace(scene, materials=negative))
    assert power.min() > 0 and chance.sum() == pytest.approx(1)
    assert light_sources(scene_of(*plane(), albedo=0.5), region) == []
