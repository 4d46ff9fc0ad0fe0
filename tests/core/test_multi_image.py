"""Rays through cube maps, against closed forms and Embree."""

import numpy as np
import pytest
from photon_bake.addon.core.compiling import kernel
from photon_bake.addon.core.errors import Cancelled
from photon_bake.addon.core.parallel import Workers
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.core.sampling.streams import stream
from photon_bake.addon.core.vec3 import row
from photon_bake.addon.scene import RayKind
from photon_bake.addon.tracing.cube_maps import CubeMaps, LightRays, MultiImageTracer, Statistics, lit_region
from photon_bake.addon.tracing.cube_maps.cube_maps import _texel_directions
from photon_bake.addon.tracing.cube_maps.placement import placed, regular, seen_solid_angle
from photon_bake.addon.tracing.cube_maps.search.map_index import MapIndex, cell_at
from photon_bake.addon.tracing.cube_maps.search.segments import LitSides
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, merge, plane, scene_of
from photon_bake.tests.core.warp_loops import sample_uniform_sphere
from photon_bake.tests.cube_map_methods.fan import Fan
from photon_bake.tests.cube_map_methods.plane import Plane

# Share of the hits in a box, and how far off, m: of texels on its edges only one wall is known, and the secant method
# does not always come to the wall
TOLERANCE = {None: (0.98, 1e-4), Fan: (0.97, 0.05), Plane: (0.9, 0.05)}


def images(scene, region=None, **options):
    region = scene.bounds if region is None else np.array(region, np.float32)
    return MultiImageTracer.build(scene, EmbreeTracer(scene), region, **{"n_maps": 8, "size": 32} | options)


def maps_at(scene, *centres, size=32):
    centres = np.array(centres, np.float32)
    return CubeMaps.taken_from(centres, size, scene, EmbreeTracer(scene), RayKind.DIFFUSE, Workers())


def directions(n, seed=1):
    return sample_uniform_sphere(stream(seed).random((n, 2), np.float32))


def sphere(radius=0.5, n=48):
    """A ball of triangles that faces out, seen from nowhere to be farther than 0.3 % of its radius from a round one."""
    theta, phi = np.linspace(0, np.pi, n + 1), np.linspace(0, 2 * np.pi, 2 * n + 1)
    grid = np.stack(
        np.broadcast_arrays(
            np.sin(theta)[:, None] * np.cos(phi), np.sin(theta)[:, None] * np.sin(phi), np.cos(theta)[:, None]
        ),
        axis=-1,
    )
    corner = np.arange((n + 1) * (2 * n + 1)).reshape(n + 1, -1)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    upper, lower = np.stack([a[1:], b[1:], d[1:]], axis=-1), np.stack([b[:-1], c[:-1], d[:-1]], axis=-1)
    triangles = np.concatenate([upper.reshape(-1, 3), lower.reshape(-1, 3)])
    return (radius * grid.reshape(-1, 3)).astype(np.float32), triangles.astype(np.int32)


def disagreement(tracer, scene, origins, ways):
    """Distance between the hits and Embree's, infinite where only one of them is a hit."""
    got, expected = (one.closest_hit(origins, ways).distance for one in (tracer, EmbreeTracer(scene)))
    both = np.isfinite(got) & np.isfinite(expected)
    apart = np.abs(np.where(both, got, 0) - np.where(both, expected, 0))
    return np.where(both | (np.isinf(got) & np.isinf(expected)), apart, np.inf)


@pytest.mark.parametrize("method", TOLERANCE)
def test_walls_of_a_box_are_exact_planes(method):
    share, tolerance = TOLERANCE[method]
    tracer = images(scene_of(*box()), method=method, placement="regular")
    origins, ways = stream(2).uniform(-0.95, 0.95, (3000, 3)).astype(np.float32), directions(3000)
    with np.errstate(divide="ignore"):
        expected = ((np.copysign(1, ways) - origins) / ways).min(axis=1)
    hits = tracer.closest_hit(origins, ways)
    assert (np.abs(hits.distance - expected) < tolerance).mean() >= share
    wall = np.abs(origins + hits.distance[:, None] * ways).argmax(axis=1)
    assert (np.abs(hits.normal).argmax(axis=1) == wall).mean() > 0.97


def test_a_ball_is_met_where_it_is():
    scene = scene_of(*merge(box(), sphere()))
    tracer = images(scene, n_maps=27, size=64)
    origins = stream(4).uniform(-0.95, 0.95, (4000, 3)).astype(np.float32)
    origins = origins[np.linalg.norm(origins, axis=1) > 0.55]
    ways = stream(5).uniform(-0.5, 0.5, origins.shape).astype(np.float32) - origins
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    b = (origins * ways).sum(axis=1)
    root = b * b - (origins**2).sum(axis=1) + 0.25
    meets = root > 0.01
    distance = -b - np.sqrt(np.maximum(root, 0))
    hits = tracer.closest_hit(origins, ways)
    assert meets.mean() > 0.5 and (np.abs(hits.distance - distance)[meets] < 0.02).mean() > 0.95


def test_rays_from_a_ball_leave_it():
    scene = scene_of(*merge(box(), sphere()))
    inwards = -directions(3000)
    hits = EmbreeTracer(scene).closest_hit(-0.9 * inwards, inwards)
    positions, normals = hits.points(scene, inwards)
    ways = directions(3000, seed=7)
    ways *= np.copysign(1, (ways * normals).sum(axis=1, keepdims=True))
    origins = positions + scene.ray_offset(hits.triangle, positions) * normals
    assert (disagreement(images(scene, n_maps=27, size=64), scene, origins, ways) < 0.02).mean() > 0.98


def test_grazing_rays_pass_over_their_own_surface():
    """Half a degree over a floor rays get to the walls, but for the texels that see both."""
    scene = scene_of(*box())
    angle = stream(5).uniform(0, 2 * np.pi, 2000)
    ways = np.stack([np.cos(angle), np.sin(angle), np.full(2000, 0.009)], axis=1).astype(np.float32)
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    floor = stream(6).uniform(-0.9, 0.9, (2000, 3)).astype(np.float32) * [1, 1, 0] + np.float32([0, 0, -1 + 1e-5])
    tracer = images(scene, size=64, placement="regular")
    assert (disagreement(tracer, scene, floor.astype(np.float32), ways) < 0.02).mean() > 0.96


def test_rays_that_leave_the_scene_meet_nothing():
    scene = scene_of(*plane())
    tracer = images(scene)
    origins = stream(7).uniform(-3, 3, (1000, 3)).astype(np.float32)
    origins[:, 2] = np.abs(origins[:, 2]) + 0.1
    up = directions(1000)
    up[:, 2] = np.abs(up[:, 2])
    assert not tracer.closest_hit(origins, up).hit.any()
    assert (disagreement(tracer, scene, origins, -up) < 1e-3).mean() > 0.98


def test_what_no_map_sees_is_met_from_its_back_or_missed():
    """A map outside a closed box, rays inside of it: they start hidden, and come to the walls from behind."""
    scene = scene_of(*box(inwards=False))
    tracer = images(scene, [[2, -3, -3], [5, 3, 3]], n_maps=27, placement="regular")
    origins = np.zeros((500, 3), np.float32)
    towards_maps = directions(500) * np.float32(0.3) + np.float32([1, 0, 0])
    towards_maps /= np.linalg.norm(towards_maps, axis=1, keepdims=True)
    hits = tracer.closest_hit(origins, towards_maps)
    back = hits.back(towards_maps) & hits.hit
    assert back.mean() > 0.95 and np.allclose((hits.distance * towards_maps[:, 0])[back], 1, atol=1e-3)
    away = tracer.closest_hit(origins, -towards_maps)
    assert not (away.distance < 0.99).any()


def test_a_scene_without_triangles_has_no_hits():
    scene = scene_of(np.zeros((0, 3)), np.zeros((0, 3)))
    tracer = images(scene)
    assert not tracer.closest_hit(np.zeros((5, 3), np.float32), directions(5)).hit.any()
    assert not tracer.occluded(np.zeros((5, 3), np.float32), directions(5)).any()


@pytest.mark.parametrize("method", TOLERANCE)
@pytest.mark.parametrize("placement", ["regular", "placed"])
def test_one_map_is_enough_for_a_box(method, placement):
    scene = scene_of(*box())
    tracer = images(scene, n_maps=1, size=64, method=method, placement=placement)
    origins = stream(8).uniform(-0.9, 0.9, (1000, 3)).astype(np.float32)
    assert len(tracer.maps) == 1
    assert (disagreement(tracer, scene, origins, directions(1000)) < 0.05).mean() > 0.85


def test_a_map_inside_a_solid_does_no_harm():
    """A regular grid of 27 has its middle in the solid: rays from around it, and from its surface, do not care."""
    scene = scene_of(*merge(box(), box(0.3, inwards=False)))
    tracer = images(scene, n_maps=27, size=64, placement="regular")
    origins = stream(9).uniform(-0.95, 0.95, (4000, 3)).astype(np.float32)
    origins = origins[np.abs(origins).max(axis=1) > 0.35]
    assert (disagreement(tracer, scene, origins, directions(len(origins))) < 0.01).mean() > 0.98
    on_top = origins[np.abs(origins[:, :2]).max(axis=1) < 0.29] * [1, 1, 0] + np.float32([0, 0, 0.30001])
    ways = directions(len(on_top))
    ways[:, 2] = np.abs(ways[:, 2])
    assert (disagreement(tracer, scene, on_top.astype(np.float32), ways) < 0.01).mean() > 0.98


@pytest.mark.parametrize("method", TOLERANCE)
def test_t_max_ends_rays(method):
    tracer = images(scene_of(*box()), method=method)
    origins, ways = stream(3).uniform(-0.9, 0.9, (1000, 3)).astype(np.float32), directions(1000)
    far, near = tracer.closest_hit(origins, ways), tracer.closest_hit(origins, ways, np.float32(0.7))
    assert (near.distance[near.hit] <= 0.7).all() and near.hit.any() and not near.hit.all()
    if method is not Plane:  # of which each map's answer is another
        assert np.array_equal(near.hit, far.distance <= 0.7)


def test_targets_on_surfaces_are_seen_and_those_behind_are_not():
    scene = scene_of(*merge(box(), sphere()))
    tracer = images(scene, n_maps=27, size=64)
    normals = directions(2000)
    ball = np.float32(0.4995) * normals
    above = np.float32(0.95) * normals
    assert tracer.occluded(above, ball).mean() < 0.02
    assert tracer.occluded(above, -above).mean() > 0.98


def test_kinds_of_rays_see_their_own_objects():
    scene = scene_of(*merge(plane(z=1), plane(z=0)))
    scene.objects.seen_in_gloss[:2] = False
    tracer = images(scene)
    origin, down = np.array([[0.3, 0.1, 2]], np.float32), np.array([[0, 0, -1]], np.float32)
    for kind, distance in ((RayKind.DIFFUSE, 1), (RayKind.GLOSSY, 2)):
        assert tracer.closest_hit(origin, down, kind=kind).distance[0] == pytest.approx(distance, abs=1e-5)
    assert tracer.n_bytes == 2 * tracer.maps.n_bytes


def test_threads_change_nothing():
    scene = scene_of(*merge(box(), box(0.3, inwards=False)))
    one, three = (images(scene, workers=Workers(5, n)) for n in (1, 3))
    assert np.array_equal(one.maps.centres, three.maps.centres)
    origins, ways = stream(3).uniform(-0.9, 0.9, (4000, 3)).astype(np.float32), directions(4000)
    whole = one.closest_hit(origins, ways)
    parts = list(
        Workers(0, 3).map(lambda k: three.closest_hit(origins[k], ways[k]), np.split(np.arange(4000), [100, 1500]))
    )
    assert np.array_equal(whole.distance, np.concatenate([part.distance for part in parts]))
    assert np.array_equal(whole.triangle, np.concatenate([part.triangle for part in parts]))


def test_taking_maps_tells_how_far_it_is_and_can_be_cancelled():
    heard = []
    images(
        scene_of(*box()), workers=Workers(progress=Progress(lambda stage, fraction: heard.append((stage, fraction))))
    )
    assert {stage for stage, _ in heard} == {"Taking cube maps"}
    fractions = [fraction for _, fraction in heard]
    assert fractions == sorted(fractions) and fractions[-1] == pytest.approx(1)
    cancelled = Progress()
    cancelled.cancel()
    with pytest.raises(Cancelled):
        images(scene_of(*box()), workers=Workers(progress=cancelled))


def test_statistics_count_what_rays_take():
    tracer = images(scene_of(*box()))
    origins = np.zeros((100, 3), np.float32)
    tracer.statistics = Statistics()
    tracer.closest_hit(origins, directions(100))
    tracer.closest_hit(origins + 9, directions(100))  # these start outside, and most pass by
    assert tracer.statistics.n_rays == 200 and tracer.statistics.n_rays_of_loops.sum() == 200
    assert tracer.statistics.n_rays_of_loops[0] > 80
    assert 100 * 2 < tracer.statistics.n_look_ups < 200 * 50


def test_texels_say_what_embree_sees():
    scene = scene_of(*merge(box(), plane(0.5)), albedo=[0.2, 0.8], material=np.repeat([0, 1], [12, 2]))
    maps = maps_at(scene, (0.1, 0.2, 0.5), size=16)
    p = directions(500)
    texel, z = maps.texel(np.zeros(500, np.int64), p)
    assert np.allclose(z, np.abs(p).max(axis=1))
    way = _texel_directions(16)[texel]
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    hits = EmbreeTracer(scene).closest_hit(np.tile(maps.centres, (500, 1)), way)
    assert np.array_equal(maps.triangle[texel], hits.triangle)
    assert np.allclose(maps.distance[texel], hits.distance)
    normal, h = maps.plane(texel)
    assert ((normal * way).sum(axis=1) < 0).all()
    assert np.allclose(h, (normal * way).sum(axis=1) * hits.distance, atol=1e-5)
    assert np.array_equal(maps.albedo[texel, 0], np.where(maps.material[texel] == 1, 204, 51))


def test_mip_chain_is_conservative():
    """No point of a texel's plane, seen through the texel, is nearer or farther than the cells that contain it say."""
    scene = scene_of(*merge(box(), plane(0.5), sphere(0.2)))
    maps = maps_at(scene, (0.1, 0.2, 0.5), (-0.6, 0.3, -0.7), size=16)
    which, p = np.repeat([0, 1], 2000), directions(4000)
    texel, z = maps.texel(which, p)
    normal, h = maps.plane(texel)
    depth = h / (normal * p).sum(axis=1) * z
    seen = np.isfinite(depth) & (depth > 0)
    face_and_row, column = np.divmod(texel, 16)
    face, row = np.divmod(face_and_row, 16)
    for level in range(maps.n_levels):
        side = 16 >> level
        cell = maps.level_start[level] + (face * side + (row >> level)) * side + (column >> level)
        assert (maps.nearest[cell][seen] <= depth[seen] * (1 + 1e-5)).all()
        assert (maps.farthest[cell][seen] >= depth[seen] * (1 - 1e-5)).all()
    assert len(maps.nearest) == maps.level_start[-1] + 12


@kernel
def cells_at(index, positions, cell):
    for i in range(len(positions)):
        cell[i] = cell_at(index, row(positions, i))


def maps_to_ask(index, positions):
    cell = np.empty(len(positions), np.int64)
    cells_at(index.arrays, positions, cell)
    return index.choices[cell]


def test_index_names_maps_that_see_the_place():
    """Two rooms, one map in each: either room's places ask the map in it first."""
    scene = scene_of(*merge(box(0.5), (box(0.5)[0] + np.float32([1, 0, 0]), box(0.5)[1])))
    maps = maps_at(scene, (0, 0, 0), (1, 0, 0))
    index = MapIndex.of(maps, np.array([[-0.5, -0.5, -0.5], [1.5, 0.5, 0.5]], np.float32), scene.bounds, Workers())
    places = stream(2).uniform(-0.45, 0.45, (500, 3)).astype(np.float32)
    for room in (0, 1):
        assert (maps_to_ask(index, places + np.float32([room, 0, 0]))[:, 0] == room).mean() > 0.9
    assert maps_to_ask(index, np.array([[1e6, 0, 0], [-1e6, 1e6, 1e6]], np.float32)).shape == (2, 2)


def test_placed_maps_see_more_than_regular_ones():
    """A solid block fills the middle of a room: most of a regular grid is in it."""
    scene = scene_of(*merge(box(), box(0.8, inwards=False)))
    tracer = EmbreeTracer(scene)
    walls = stream(1).uniform(-1, 1, (600, 3)).astype(np.float32)
    side = np.argmax(np.abs(walls), axis=1)
    normals = -np.sign(walls) * (np.arange(3) == side[:, None])
    on_walls = LitSides(np.where(normals != 0, -0.999 * normals, walls).astype(np.float32), normals.astype(np.float32))
    shares = [
        np.mean(np.any([seen_solid_angle(tracer, place, on_walls) > 0 for place in places], axis=0))
        for places in (regular(scene.bounds, 8), placed(scene, tracer, scene.bounds, 8, 32, Workers()))
    ]
    assert shares[0] == 0 and shares[1] > 0.9


def test_maps_are_placed_where_light_goes():
    """Of two rooms, only the lit one gets maps."""
    scene = scene_of(*merge(box(0.5), (box(0.5)[0] + np.float32([1.5, 0, 0]), box(0.5)[1])))
    light = LightRays(np.zeros((200, 3), np.float32), directions(200))
    centres = placed(scene, EmbreeTracer(scene), scene.bounds, 8, 32, Workers(), light)
    assert (centres[:, 0] < 0.5).all() and len(centres) == 8


@pytest.mark.parametrize("n", [1, 5, 27, 30])
def test_regular_places_fill_their_region(n):
    region = np.array([[0, 0, 0], [3, 3, 6]], np.float32)
    places = regular(region, n)
    assert places.shape == (n, 3) and len(np.unique(places, axis=0)) == n
    assert ((places > region[0]) & (places < region[1])).all()
    assert np.allclose(np.sort(np.unique(regular(region, 27)[:, 2])), [1, 3, 5])


def test_lit_region_leaves_out_what_is_far():
    points = np.concatenate([stream(1).uniform(0, 1, (1000, 3)), np.full((10, 3), 1e4)])
    region = lit_region(points)
    assert region.shape == (2, 3) and (region[0] < 0.05).all() and (region[1] < 1).all() and (region[1] > 0.95).all()
