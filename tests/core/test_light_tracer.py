"""Light past and through surfaces: see-through ones, coincident ones, kinds of rays, light linking."""

import numpy as np
import pytest
from photon_bake.addon.photons.first_flight import first_flight
from photon_bake.addon.photons.lamp_sources import PointSource
from photon_bake.addon.photons.source import bounding_sphere
from photon_bake.addon.scene import Channel, LightKind, Materials, SceneObjects
from photon_bake.addon.tracers import LightTracer, RayKind
from photon_bake.addon.tracers.embree import EmbreeTracer
from photon_bake.tests.core.scenes import lamp, merge, plane, scene_of

DOWN = np.float32([0, 0, -1])


def stacked(heights, materials=None, **options):
    """Planes facing up at some heights, each of its own object and material."""
    mesh = merge(*(plane(1.0, z) for z in heights))
    n = len(heights)
    scene = scene_of(*mesh, albedo=[0.5] * n, material=np.repeat(np.arange(n), 2), **options)
    object.__setattr__(scene, "object_of_triangle", np.repeat(np.arange(n, dtype=np.int32), 2))
    object.__setattr__(scene, "objects", SceneObjects.seen_by_all(tuple("abc"[:n])))
    if materials is not None:
        object.__setattr__(scene, "materials", materials)
    return scene


def half_covered(tints=((1, 0.5, 0.25), (1, 1, 1)), coverage=(0.5, 1.0)):
    return Materials.of(len(coverage), coverage=Channel.constant(coverage), tint=Channel.constant(np.array(tints)))


def from_above(n):
    origins = np.random.default_rng(1).uniform(-0.9, 0.9, (n, 3)).astype(np.float32)
    origins[:, 2] = 3
    return origins, np.tile(DOWN, (n, 1))


def light_tracer(scene):
    return LightTracer(scene, EmbreeTracer(scene))


def test_half_covered_plane_stops_half_of_the_rays():
    origins, directions = from_above(20_000)
    hits = light_tracer(stacked([1, 0], half_covered())).closest_hit(origins, directions)
    through = hits.distance > 2.5
    assert through.mean() == pytest.approx(0.5, abs=0.02)
    np.testing.assert_allclose(hits.distance[through], 3, atol=1e-3)
    np.testing.assert_allclose(hits.tint[through], np.tile([1, 0.5, 0.25], (through.sum(), 1)))
    np.testing.assert_allclose(hits.tint[~through], 1)


def test_what_passes_does_not_depend_on_the_batch():
    origins, directions = from_above(100)
    tracer = light_tracer(stacked([1, 0], half_covered()))
    together = tracer.closest_hit(origins, directions)
    apart = tracer.closest_hit(origins[40:60], directions[40:60])
    assert np.array_equal(together.triangle[40:60], apart.triangle)


def test_visibility_is_what_the_surfaces_between_leave():
    scene = stacked([2, 1, 0], half_covered([(1, 1, 1), (0.5, 1, 1), (1, 1, 1)], [0.5, 0.2, 1.0]))
    origins, _ = from_above(5)
    above = origins.copy()
    above[:, 2] = 0.5
    passes = light_tracer(scene).visibility(origins, above)
    np.testing.assert_allclose(passes, np.tile([0.5 * 0.8 * 0.5, 0.4, 0.4], (5, 1)), rtol=1e-5)
    below = origins - np.float32([0, 0, 4])
    assert not light_tracer(scene).visibility(origins, below).any()


def test_each_kind_of_ray_sees_its_objects():
    scene = stacked([2, 1, 0])
    scene.objects.seen_in_gloss[0] = False
    scene.objects.seen_through_glass[:2] = False
    origins, directions = from_above(3)
    kinds = np.array([RayKind.DIFFUSE, RayKind.GLOSSY, RayKind.TRANSMITTED], np.uint8)
    hits = light_tracer(scene).closest_hit(origins, directions, kinds)
    np.testing.assert_allclose(hits.distance, [1, 2, 3], atol=1e-4)
    at = scene.points(hits.triangle, hits.u, hits.v)
    np.testing.assert_allclose(at, hits.points(origins, directions)[0], atol=1e-4)


def test_surfaces_in_one_place_are_dark():
    """As in Cycles: a ray that leaves one of them meets the other at once."""
    scene = stacked([0, 0])
    origins, directions = from_above(100)
    assert not light_tracer(scene).closest_hit(origins, directions).tint.any()
    apart = light_tracer(stacked([1e-3, 0])).closest_hit(origins, directions)
    assert apart.tint is None


@pytest.mark.parametrize("half", [1.0, 0.7])
def test_faces_in_one_place_are_dark_whichever_way_they_are_cut(half):
    """By Cycles a floor that is there twice is as dark with the second one's diagonal across the first one's."""
    (vertices, _), large = plane(half), plane(1.0)
    scene = scene_of(*merge(large, (vertices, np.array([[0, 1, 3], [1, 2, 3]], np.int32))))
    origins, directions = from_above(2000)
    hits = light_tracer(scene).closest_hit(origins, directions)
    within = (np.abs(origins[:, :2]) < half).all(axis=1)
    assert np.array_equal((hits.tint == 0).all(axis=1), within)


def test_only_where_they_overlap():
    small, large = plane(0.5), plane(1.0)
    scene = scene_of(*merge(large, (small[0] + [0.5, 0.5, 0], small[1])))
    origins, directions = from_above(2000)
    hits = light_tracer(scene).closest_hit(origins, directions)
    overlap = (origins[:, :2] > 0).all(axis=1)
    dark = (hits.tint == 0).all(axis=1)
    assert np.array_equal(dark, overlap) or (dark != overlap).mean() < 0.005


def test_neighbours_that_share_an_edge_are_not_in_one_place():
    scene = scene_of(*plane(1.0))
    origins, directions = from_above(1000)
    assert light_tracer(scene).closest_hit(origins, directions).tint is None


def flown(scene, illuminates=None, blocked_by=None, n=20_000):
    """Photons of a spot above two planes; where they end, by object, in watts."""
    light = lamp(LightKind.SPOT, 1.0, position=(0, 0, 3), angle=0.3)
    source = PointSource(light, 0, bounding_sphere(scene))
    source.illuminates, source.blocked_by = illuminates, blocked_by
    random = np.random.default_rng(2)
    rays = source.emit(random.random((n, 5), dtype=np.float32))
    power = rays.flux / np.float32(n)
    hits, power = first_flight(scene, light_tracer(scene), source, rays.origins, rays.directions, power, random)
    of_object = np.where(hits.hit, scene.object_of_triangle[hits.triangle], -1)
    return [float(power[of_object == i].sum()) for i in range(2)], float(3 * source.power[0])


@pytest.mark.parametrize(
    "illuminates, blocked_by, expected",
    [
        (None, None, [1, 0]),
        ([False, True], None, [0, 0]),  # the upper plane is not lit and still casts its shadow
        (None, [False, False], [1, 1]),  # no shadow: both are lit
        ([False, True], [False, True], [0, 1]),
    ],
)
def test_photons_keep_to_light_linking(illuminates, blocked_by, expected):
    masks = (None if mask is None else np.array(mask) for mask in (illuminates, blocked_by))
    ended, emitted = flown(stacked([1, 0]), *masks)
    np.testing.assert_allclose(ended, np.array(expected) * emitted, atol=0.04 * emitted)


def test_shadow_of_an_object_that_photons_do_not_meet():
    scene = stacked([1, 0])
    scene.objects.scatters[0] = False
    ended, _ = flown(scene)
    assert ended == [0, 0]
