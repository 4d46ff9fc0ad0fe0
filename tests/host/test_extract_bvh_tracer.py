"""The tracer on Blender's own BVH, against every triangle tried in turn."""

import numpy as np
import pytest
from photon_bake.addon.blender import BVHTracer, extract_scene
from photon_bake.tests.host import scenes


def try_all(scene, origins, directions, of_objects):
    """Nearest triangle and distance of each ray (Möller and Trumbore 1997), over triangles of some objects."""
    a, b, c = (scene.vertices[scene.triangles[:, i]].astype(float) for i in range(3))
    p = np.cross(directions[:, None], c - a)
    det = np.einsum("tj,rtj->rt", b - a, p)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = origins[:, None] - a
        u = (s * p).sum(-1) / det
        q = np.cross(s, b - a)
        v = (directions[:, None] * q).sum(-1) / det
        t = np.einsum("tj,rtj->rt", c - a, q) / det
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & of_objects[scene.object_of_triangle]
    t = np.where(hit, t, np.inf)
    nearest = t.argmin(1)
    return np.where(np.isinf(t.min(1)), -1, nearest), t.min(1)


@pytest.fixture
def scene(empty_scene):
    for i in range(3):
        obj = scenes.add_cube(f"Cube {i}")
        obj.location, obj.rotation_euler = (3 * i, i, -i), (i, 0.3, 0.1 * i)
    obj.visible_shadow = False
    ghost = scenes.add_plane("Ghost", 9)
    ghost.visible_diffuse, ghost.location = False, (0, 0, -3)
    return extract_scene(scenes.depsgraph())


@pytest.fixture
def rays():
    rng = np.random.default_rng(6)
    origins = rng.normal(0, 5, (500, 3))
    directions = rng.uniform(-1, 5, (500, 3)) - origins + rng.normal(0, 1, (500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return origins.astype(np.float32), directions.astype(np.float32)


def test_closest_hit(scene, rays):
    origins, directions = rays
    hits = BVHTracer(scene).closest_hit(origins, directions)
    triangle, distance = try_all(scene, origins.astype(float), directions.astype(float), scene.objects.scatters)
    np.testing.assert_array_equal(hits.triangle, triangle)
    assert 0.2 < hits.hit.mean() < 0.9
    np.testing.assert_allclose(hits.distance, distance, rtol=1e-4)
    on = hits.hit
    points = scene.points(hits.triangle[on], hits.u[on], hits.v[on])
    np.testing.assert_allclose(points, origins[on] + directions[on] * hits.distance[on, None], atol=1e-4)
    np.testing.assert_allclose(hits.normal[on], scene.normals[hits.triangle[on]])
    assert [a.dtype for a in (hits.triangle, hits.distance, hits.u, hits.v, hits.normal)] == [np.int32] + [
        np.float32
    ] * 4


def test_farthest_distance(scene, rays):
    tracer = BVHTracer(scene)
    everything = tracer.closest_hit(*rays)
    near = tracer.closest_hit(*rays, t_max=4.0)
    np.testing.assert_array_equal(near.hit, everything.distance <= 4)


def test_occluded(scene, rays):
    origins, directions = rays
    _, distance = try_all(scene, origins.astype(float), directions.astype(float), scene.objects.casts_shadow)
    tracer = BVHTracer(scene)
    np.testing.assert_array_equal(tracer.occluded(origins, origins + 20 * directions), distance < 20)
    on = np.isfinite(distance)
    surface = (origins + directions * distance[:, None])[on].astype(np.float32)
    assert not tracer.occluded(origins[on], surface).any()


def test_nothing_to_hit():
    tracer = BVHTracer(extract_scene(scenes.depsgraph()))
    ones = np.ones((3, 3), np.float32)
    assert not tracer.closest_hit(ones, ones).hit.any()
    assert not tracer.occluded(ones, -ones).any()
    assert len(tracer.closest_hit(ones[:0], ones[:0]).triangle) == 0
