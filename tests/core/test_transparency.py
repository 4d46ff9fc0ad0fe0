"""Light past and through surfaces: see-through ones, coincident ones, kinds of rays, light linking."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.core.sampling.path_numbers import PathNumbers
from photon_bake.addon.emitters import bounding_sphere, light_sources
from photon_bake.addon.photons.emission import Emission, Pass
from photon_bake.addon.photons.emission_segment import LightLinking, emission_segment
from photon_bake.addon.photons.front import new_front
from photon_bake.addon.scene import Channel, LightKind, Materials, RayKind, SceneObjects
from photon_bake.addon.tracing import Hits, TransparencyTracer
from photon_bake.addon.tracing.coincident import CoincidentSurfaces
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, lamp, merge, of_objects, plane, scene_of

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
    return TransparencyTracer(scene, EmbreeTracer(scene))


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
    np.testing.assert_allclose(at, origins + hits.distance[:, None] * directions, atol=1e-4)


def test_surfaces_in_one_place_are_dark():
    """As in Cycles: a ray that leaves one of them meets the other at once."""
    scene = stacked([0, 0])
    origins, directions = from_above(100)
    assert not light_tracer(scene).closest_hit(origins, directions).tint.any()
    apart = light_tracer(stacked([1e-3, 0])).closest_hit(origins, directions)
    assert apart.tint is None


def test_of_tilted_surfaces_in_one_place_half_of_the_points_are_in_front():
    """In Cycles rounding decides of each point, by the tilt for a little more or fewer than half of them."""
    flat, turn = stacked([0, 0]), np.linalg.qr([[1, 2, 3], [2, 1, 1], [0, 1, 3]])[0].astype(np.float32)
    scene = scene_of(flat.vertices @ turn, flat.triangles, albedo=[0.5] * 2, material=flat.material_of_triangle)
    origins, directions = from_above(20_000)
    tracer = light_tracer(of_objects(scene, np.repeat([0, 1], 2)))
    hits = tracer.closest_hit(origins @ turn, directions @ turn)
    assert set(np.unique(hits.tint)) == {0.0, 1.0} and hits.tint.mean() == pytest.approx(0.5, abs=0.015)
    assert tracer.coplanar_occluded(hits.triangle, hits.u, hits.v).mean() == pytest.approx(0.5, abs=0.015)


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


def sheet(n, half=1.0, z=0.0, up=True):
    """A plane of n² quads."""
    x, y = (axis.ravel() for axis in np.meshgrid(*2 * [np.linspace(-half, half, n + 1)], indexing="ij"))
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    triangles = np.concatenate([np.stack([a, a + n + 1, a + n + 2], 1), np.stack([a, a + n + 2, a + 1], 1)])
    return np.stack([x, y, np.full(x.size, z)], axis=1).astype(np.float32), triangles[:, :: 1 if up else -1]


def layers(*sheets, coverage=(0.5, 0.5), shift=(0, 0, 0)):
    """Sheets, each of its own coverage."""
    vertices, triangles = merge(*sheets)
    material = np.repeat(np.arange(len(sheets)), [len(one[1]) for one in sheets])
    scene = scene_of(vertices + np.float32(shift), triangles, albedo=[0.5] * len(sheets), material=material)
    object.__setattr__(scene, "materials", Materials.of(len(sheets), coverage=Channel.constant(coverage)))
    return scene


def test_walls_that_overlap_in_part_are_found_among_many_triangles():
    """Neither's middles lie on the other, and Embree's rounding decides which of the two a ray finds."""
    wall = plane(1.0)
    vertices, triangles = merge(wall, (wall[0] + np.float32([1.5, 0, 0]), wall[1]), sheet(270, half=3, z=-2))
    turn = np.linalg.qr([[1, 2, 3], [2, 1, 1], [0, 1, 3]])[0]
    scene = scene_of((vertices @ turn).astype(np.float32), triangles)
    shares = CoincidentSurfaces(scene, EmbreeTracer(scene), Progress()).arrays.shares
    assert shares[:4].all() and not shares[4:].any()


def at_grazing(angle, n, shift=(0, 0, 0), reach=0.4):
    """Rays through a middle part of the ground, at an angle to it: where they start and what they aim at."""
    random = np.random.default_rng(8)
    at, phi = random.uniform(-0.5, 0.5, (n, 2)), random.uniform(0, 2 * np.pi, n)
    way = np.stack([np.cos(phi) * np.cos(angle), np.sin(phi) * np.cos(angle), np.full(n, -np.sin(angle))], axis=1)
    middle = np.concatenate([at, np.zeros((n, 1))], axis=1) + shift
    return (middle - reach * way).astype(np.float32), (middle + reach * way).astype(np.float32)


@pytest.mark.parametrize("height", [0, 20])
@pytest.mark.parametrize("angle", [1, 0.1, 1e-2, 1e-3, 1e-4])
def test_flat_rays_pass_a_surface_once(angle, height):
    """Where rounding has it that a ray meets the same surface again, or its next triangle."""
    shift = (0.1 * height, 0, height)
    scene = layers(sheet(8), coverage=[0.5], shift=shift)
    tracer, (origins, targets) = light_tracer(scene), at_grazing(angle, 4000, shift)
    passes = tracer.visibility(origins, targets)
    crosses = (origins[:, 2] > height) & (targets[:, 2] < height)
    assert crosses.mean() > 0.99
    np.testing.assert_allclose(passes[crosses], 0.5)

    way = (targets - origins) / np.linalg.norm(targets - origins, axis=1, keepdims=True)
    through = ~tracer.closest_hit(origins, way.astype(np.float32)).hit
    assert through[crosses].mean() == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize("angle", [1.5, 0.3])
@pytest.mark.parametrize("gap", [1e-3, 1e-5, 3e-6, 0])
def test_thin_walls_and_surfaces_in_one_place_count_twice(angle, gap):
    scene = layers(sheet(3), sheet(3, z=-gap, up=gap == 0), coverage=[0.5, 0.2])
    tracer, (origins, targets) = light_tracer(scene), at_grazing(angle, 4000)
    passes = tracer.visibility(origins, targets)
    assert passes.mean() == pytest.approx(0.5 * 0.8, rel=2e-3)
    way = (targets - origins) / np.linalg.norm(targets - origins, axis=1, keepdims=True)
    through = ~tracer.closest_hit(origins, way.astype(np.float32)).hit
    assert through.mean() == pytest.approx(0.5 * 0.8, abs=0.03)


@pytest.mark.parametrize("angle", [0.3, 1e-2, 1e-3])
def test_flat_rays_pass_both_of_faces_back_to_back_once(angle):
    scene = layers(sheet(1), sheet(1, up=False), coverage=[0.5, 0.2], shift=(2, 0, 20))
    passes = light_tracer(scene).visibility(*at_grazing(angle, 4000, (2, 0, 20), reach=0.2))
    assert passes.mean() == pytest.approx(0.5 * 0.8, rel=2e-3)


def test_no_light_passes_a_wall_that_a_see_through_surface_lies_on():
    for coverage in ([0.5, 1], [1, 0.5]):
        scene = layers(*2 * [sheet(3)], coverage=coverage)
        tracer, (origins, targets) = light_tracer(scene), at_grazing(1.0, 1000)
        assert tracer.visibility(origins, targets).mean() < 2e-3
        way = (targets - origins) / np.linalg.norm(targets - origins, axis=1, keepdims=True)
        assert tracer.closest_hit(origins, way.astype(np.float32)).hit.mean() > 0.998


def test_an_unseen_surface_leaves_a_wall_that_it_lies_on_bright():
    scene = layers(*2 * [sheet(3)], coverage=[0, 1])
    origins, directions = from_above(1000)
    hits = light_tracer(scene).closest_hit(origins, directions)
    assert (scene.material_of_triangle[hits.triangle] == 1).mean() > 0.998
    assert hits.tint.mean() > 0.998


@pytest.mark.parametrize("angle", [1e-2, 1e-3])
def test_flat_rays_do_not_pass_walls_that_stand_on_the_surface(angle):
    """A step that clears the surface at such an angle would be a thousand times the margin of a wall."""
    upright = np.float32([(0, -1, -1), (0, 1, -1), (0, 1, 1), (0, -1, 1)]), np.array([[0, 1, 2], [0, 2, 3]])
    scene = layers(sheet(4), upright, coverage=[0.5, 1])
    random = np.random.default_rng(9)
    n = 2000
    at = np.stack([-(10 ** random.uniform(-5, -1.5, n)), random.uniform(-0.5, 0.5, n), np.zeros(n)], axis=1)
    way = np.float32([np.cos(angle), 0, -np.sin(angle)])
    passes = light_tracer(scene).visibility((at - 0.4 * way).astype(np.float32), (at + 0.4 * way).astype(np.float32))
    assert not passes.any()


def test_neighbours_that_share_an_edge_are_not_in_one_place():
    scene = scene_of(*plane(1.0))
    origins, directions = from_above(1000)
    assert light_tracer(scene).closest_hit(origins, directions).tint is None


def flown(scene, illuminates=None, blocked_by=None, n=20_000):
    """Photons of a spot above two planes; where they end, by object, in watts."""
    scene = replace(scene, lights=lamp(LightKind.SPOT, 1.0, position=(0, 0, 3), angle=0.3))
    source = light_sources(scene, bounding_sphere(scene))[0]
    source.illuminates, source.blocked_by = illuminates, blocked_by
    front = new_front(n)
    Emission([source], [n], 2, Pass.PHOTONS).start(front, slice(0, n))
    linking = LightLinking.of(scene, [source])
    hits, power = emission_segment(scene, light_tracer(scene), linking, front, PathNumbers(2)), front.power
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


def panel(n=1, shift=(0.01, 0.02, 0), up=True, walls=1, half=0.1, tilt=0.0, order=1):
    """A ground, a small emissive sheet in its plane, and a ceiling; the ground first or last, and tilted."""
    vertices, triangles = sheet(n, half, up=up)
    ground, ceiling = sheet(walls), sheet(1, z=1.0, up=False)
    parts = [(ground, 0, 0), ((vertices + np.float32(shift), triangles), 1, 1), (ceiling, 0, 2)][::order]
    vertices, triangles = merge(*(mesh for mesh, _, _ in parts))
    size = [len(mesh[1]) for mesh, _, _ in parts]
    turned = np.float32([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]])
    material = np.repeat([material for _, material, _ in parts], size)
    scene = scene_of(vertices @ turned.T, triangles, albedo=[0.5, 0.5], emission=[0, 1], material=material)
    scene = of_objects(scene, np.repeat([obj for _, _, obj in parts], size))
    return scene, turned


@pytest.mark.parametrize("n, walls", [(1, 1), (8, 1), (1, 20), (8, 3)])
@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize("tilt", [0.0, 0.4])
@pytest.mark.parametrize("up", [True, False])
def test_what_emits_in_the_plane_of_a_wall_counts_as_in_front(n, walls, order, tilt, up):
    """Whichever of the two the tree finds first: by Cycles the light depends on that."""
    scene, turned = panel(n, up=up, walls=walls, tilt=tilt, order=order)
    tracer = light_tracer(scene)
    at = np.random.default_rng(3).uniform(-0.3, 0.3, (4000, 2)).astype(np.float32)
    origins = np.column_stack([at, np.full(len(at), 0.5, np.float32)]) @ turned.T
    hits = tracer.closest_hit(origins, np.tile(-turned[:, 2], (len(at), 1)))
    on_panel = (np.abs(at - [0.01, 0.02]) < 0.1).all(axis=1)
    assert (scene.shines[hits.triangle] != on_panel).mean() < 1e-3
    assert hits.tint is None or (hits.tint == 1).all()
    seen = np.flatnonzero(scene.shines[hits.triangle])
    assert not tracer.coplanar_occluded(hits.triangle[seen], hits.u[seen], hits.v[seen]).any()
    assert tracer.flush_emitters == [(scene.objects.names[1], scene.objects.names[0])]


@pytest.mark.parametrize("inwards", [False, True])
@pytest.mark.parametrize("walls", [sheet(1), merge(sheet(1), sheet(1, z=-0.3, up=False)), sheet(1, up=False)])
def test_solid_lamps_on_a_ground_are_no_flush_emitters(walls, inwards):
    """Of their foot nothing is seen, whichever way they or the ground are turned."""
    vertices, triangles = box(0.1, inwards=inwards)
    mesh = merge(walls, (vertices + np.float32([0, 0, 0.1]), triangles), sheet(1, z=1.0, up=False))
    of = np.repeat([0, 1, 2], [len(walls[1]), 12, 2])
    scene = of_objects(scene_of(*mesh, albedo=[0.5, 0.5], emission=[0, 1], material=of % 2), of)
    assert light_tracer(scene).flush_emitters == []


def test_solid_lamps_sunk_into_a_ground_are_flush_emitters():
    vertices, triangles = box(0.1, inwards=False)
    mesh = merge(sheet(1), (vertices - np.float32([0, 0, 0.1]), triangles), sheet(1, z=1.0, up=False))
    of = np.repeat([0, 1, 2], [2, 12, 2])
    scene = of_objects(scene_of(*mesh, albedo=[0.5, 0.5], emission=[0, 1], material=of % 2), of)
    assert len(light_tracer(scene).flush_emitters) == 1


def test_another_tracer_s_first_hits_are_gone_on_from():
    """Where it agrees with Embree, all is as with Embree alone; what it misses is missed."""

    class Blind:
        def closest_hit(self, origins, *_, **__):
            return Hits.none(len(origins))

    scene = layers(sheet(3), sheet(3, z=-0.5), coverage=[0.5, 0.2])
    tracer, (origins, directions) = light_tracer(scene), from_above(1000)
    kinds = np.arange(1000).astype(np.uint8) % 3
    alone = tracer.closest_hit(origins, directions, kinds)
    same = tracer.with_first_hits(EmbreeTracer(scene)).closest_hit(origins, directions, kinds)
    assert len(np.unique(alone.triangle)) > 2
    for name in ("triangle", "distance", "u", "v", "tint"):
        assert np.array_equal(getattr(same, name), getattr(alone, name))
    assert np.array_equal(same.normal[same.hit], alone.normal[alone.hit])
    assert not tracer.with_first_hits(Blind()).closest_hit(origins, directions).hit.any()
    assert tracer.closest_hit(origins, directions).hit.any()
