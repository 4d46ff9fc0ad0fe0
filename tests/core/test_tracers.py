"""What every tracer promises, held against the plain algebra of rays and triangles."""

import numpy as np
import pytest
from photon_bake.addon.core.sampling.streams import stream
from photon_bake.addon.tracing.cube_maps import MultiImageTracer
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, merge, plane, scene_of
from photon_bake.tests.core.warp_loops import sample_uniform_sphere


def cube_map_tracer(scene):
    return MultiImageTracer.build(scene, EmbreeTracer(scene), scene.bounds, n_maps=8)


@pytest.fixture(params=[EmbreeTracer, cube_map_tracer])
def tracer_class(request):
    return request.param


def least_agreement(tracer_class):
    """Rays through the very edge of a triangle may go either way. Images do not see small triangles sharply."""
    return 0.87 if tracer_class is cube_map_tracer else 0.999


def soup(n=200, hidden=()):
    random = np.random.default_rng(5)
    middle = random.uniform(-1, 1, (n, 1, 3))
    return scene_of((middle + random.uniform(-0.3, 0.3, (n, 3, 3))).reshape(-1, 3), np.arange(3 * n), hidden=hidden)


def rays(n=2000):
    random = stream(3)
    return random.uniform(-1.5, 1.5, (n, 3)).astype(np.float32), sample_uniform_sphere(
        random.random((n, 2), np.float32)
    )


def all_distances(scene, origins, directions):
    """Distance of every ray (n) to every triangle (t) by Cramer's rule in float64, infinite where it misses."""
    a, b, c = (scene.vertices[scene.triangles[:, i]].astype(float) for i in range(3))
    e1, e2 = b - a, c - a
    p = np.cross(directions[:, None].astype(float), e2)
    det = (p * e1).sum(-1)
    s = origins[:, None].astype(float) - a
    u = (s * p).sum(-1) / det
    q = np.cross(s, e1)
    v = (q * directions[:, None]).sum(-1) / det
    t = (q * e2).sum(-1) / det
    return np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)


def test_closest_hit_is_the_closest(tracer_class):
    scene = soup()
    origins, directions = rays()
    hits = tracer_class(scene).closest_hit(origins, directions)
    expected = all_distances(scene, origins, directions)
    nearest = expected.min(axis=1)
    agree = np.isclose(hits.distance, nearest, rtol=1e-4, atol=1e-4) | (np.isinf(hits.distance) & np.isinf(nearest))
    assert agree.mean() > least_agreement(tracer_class)
    on = agree & hits.hit
    assert np.array_equal(hits.triangle[on], expected.argmin(axis=1)[on])
    points = scene.points(hits.triangle[on], hits.u[on], hits.v[on])
    assert np.allclose(points, origins[on] + hits.distance[on, None] * directions[on], atol=1e-4)
    assert np.allclose(hits.normal[on], scene.normals[hits.triangle[on]])
    assert (hits.triangle[~hits.hit] == -1).all() and np.isinf(hits.distance[~hits.hit]).all()


def test_t_max_ends_rays(tracer_class):
    scene = soup()
    origins, directions = rays()
    tracer = tracer_class(scene)
    near, far = tracer.closest_hit(origins, directions, 0.5), tracer.closest_hit(origins, directions)
    assert np.array_equal(near.hit, far.distance <= 0.5)


def test_occluded_agrees_with_distances(tracer_class):
    scene = soup()
    origins, directions = rays()
    length = np.random.default_rng(1).uniform(0.1, 2, len(origins)).astype(np.float32)
    nearest = all_distances(scene, origins, directions).min(axis=1)
    clear = np.abs(nearest - length) > 1e-3
    occluded = tracer_class(scene).occluded(origins, origins + length[:, None] * directions)
    assert (occluded == (nearest < length))[clear].mean() > least_agreement(tracer_class)


def test_target_on_a_surface_is_seen(tracer_class):
    scene = scene_of(*plane())
    origins = np.tile(np.array([[0.1, 0.2, 1]], np.float32), (100, 1))
    targets = np.random.default_rng(2).uniform(-0.9, 0.9, (100, 3)).astype(np.float32) * [1, 1, 0]
    assert not tracer_class(scene).occluded(origins, targets.astype(np.float32)).any()


def test_objects_that_rays_do_not_see_are_passed(tracer_class):
    """The upper of two planes is hidden: rays from above meet the lower one, and keep its number."""
    scene = scene_of(*merge(plane(z=1), plane(z=0)), hidden=(0, 1))
    origin, down = np.array([[0.3, 0.1, 2]], np.float32), np.array([[0, 0, -1]], np.float32)
    tracer = tracer_class(scene)
    hits = tracer.closest_hit(origin, down)
    assert hits.triangle[0] in (2, 3) and hits.distance[0] == pytest.approx(2)
    assert not tracer.occluded(origin, origin + 1.5 * down)[0] and tracer.occluded(origin, origin + 2.5 * down)[0]


def test_shadows_and_scattering_are_told_apart(tracer_class):
    scene = scene_of(*plane())
    scene.objects.casts_shadow[:] = False
    tracer = tracer_class(scene)
    origin = np.array([[0.3, 0.1, 1]], np.float32)
    assert not tracer.occluded(origin, -origin)[0]
    assert tracer.closest_hit(origin, np.array([[0, 0, -1]], np.float32)).hit[0]


def test_scene_without_triangles(tracer_class):
    scene = scene_of(*plane(), hidden=(0, 1))
    origins, directions = rays(10)
    tracer = tracer_class(scene)
    assert not tracer.closest_hit(origins, directions).hit.any()
    assert not tracer.occluded(origins, origins + directions).any()
    assert len(tracer.closest_hit(origins[:0], directions[:0]).distance) == 0


@pytest.mark.parametrize("scale, shift", [(1e-3, 0), (1, 0), (1, 1000), (1000, 0)])
def test_offset_rays_leave_their_surface(tracer_class, scale, shift):
    """From points inside a box, rays that start off the walls meet another wall, at any size and place."""
    vertices, triangles = box(scale)
    scene = scene_of(vertices + np.float32(shift), triangles)
    random = np.random.default_rng(4)
    triangle = random.integers(0, 12, 5000).astype(np.int32)
    u, v = random.random((2, 5000), np.float32) * np.float32(0.45) + np.float32(0.02)
    normals = scene.normals[triangle]
    positions = scene.points(triangle, u, v)
    positions += scene.ray_offset(triangle, positions) * normals
    hits = tracer_class(scene).closest_hit(positions, normals)
    assert hits.hit.all()
    assert np.allclose(hits.distance, 2 * scale, rtol=0.01 + 1e-4 * shift / scale)
