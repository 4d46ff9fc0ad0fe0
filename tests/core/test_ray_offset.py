"""Rays that start off a surface neither meet it again nor skip what is near, whatever else is in the scene."""

import numpy as np
import pytest
from photon_bake.addon.tracing.embree import EmbreeTracer
from photon_bake.tests.core.scenes import box, merge, plane, scene_of

pytestmark = pytest.mark.plain

N = 300


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def triangles(size, place, slimness, random):
    """Triangles of an edge of `size` around points `place` from the origin: turned anyhow, and along the axes."""
    for turn in (*np.linalg.qr(random.normal(size=(4, 3, 3)))[0], np.eye(3), np.eye(3)[[2, 0, 1]]):
        flat = np.array([[0, 0, 0], [1, 0, 0], [random.random(), slimness, 0]]) - [random.random(), 0, 0]
        corners = size * flat @ turn + place * unit(random.normal(size=3))
        yield corners[random.permutation(3)].astype(np.float32)


def outwards(normals, random):
    """Unit directions from surfaces, half of them flat."""
    n = len(normals)
    cosine = np.where(random.random(n) < 0.5, np.sqrt(random.random(n)), 10 ** random.uniform(-4, -1, n))[:, None]
    aside = np.cross(normals, random.normal(size=(n, 3)))
    return (cosine * normals + np.sqrt(1 - cosine**2) * unit(aside)).astype(np.float32)


def arrivals(scene, tracer, random):
    """Hits of rays that come to the triangle from 1 cm to 100 km away, and their directions."""
    u, v = random.random((2, N), np.float32)
    folded = u + v > 1
    at = scene.points(np.zeros(N, np.int32), np.where(folded, 1 - u, u), np.where(folded, 1 - v, v))
    directions = unit(random.normal(size=(N, 3)))
    origins = at - 10 ** random.uniform(-2, 5, (N, 1)) * directions
    hits = tracer.closest_hit(origins.astype(np.float32), directions.astype(np.float32))
    return hits.where(hits.hit), directions[hits.hit].astype(np.float32)


@pytest.mark.parametrize("slimness", [1, 0.03, 0.001])
@pytest.mark.parametrize("size", [1e-3, 0.1, 10, 1e3, 2e5])
def test_no_ray_from_a_hit_meets_its_own_triangle(size, slimness):
    """For triangles of 1 mm to 200 km and their slivers, 0 to 200 km from the origin."""
    random, n_hits = np.random.default_rng(7), 0
    for place in (0, 1, 100, 1e4, 2e5):
        if size * slimness < 1e-6 * place:
            continue  # narrower than coordinates there are apart
        for corners in triangles(size, place, slimness, random):
            scene = scene_of(corners, [[0, 1, 2]])
            tracer = EmbreeTracer(scene)
            hits, directions = arrivals(scene, tracer, random)
            positions, normals = hits.points(scene, directions)
            origins = positions + scene.ray_offset(hits.triangle, positions) * normals
            assert not tracer.closest_hit(origins, outwards(normals, random)).hit.any()
            n_hits += len(positions)
    assert n_hits > 1000


def test_the_offset_does_not_grow_with_the_scene():
    """In a room of 10 m rays start less than 1 mm off its walls, with an ocean of 200 km around it as without."""
    room, ocean = box(5), plane(1e5, -6)
    scene, alone = scene_of(*merge(room, ocean)), scene_of(*room)
    triangle, third = np.arange(12, dtype=np.int32), np.full(12, 1 / 3, np.float32)
    offset = scene.ray_offset(triangle, scene.points(triangle, third, third))
    assert offset.max() < 1e-3
    np.testing.assert_array_equal(offset, alone.ray_offset(triangle, alone.points(triangle, third, third)))


def test_on_a_level_ground_the_offset_is_that_of_the_place():
    """However far the ground reaches: objects on it keep their shadows."""
    scene = scene_of(*plane(1e5, 0.5))
    near = np.array([[2, 1, 0.5], [-3, 4, 0.5]], np.float32)
    assert scene.ray_offset(np.zeros(2, np.int32), near).max() < 1e-4
