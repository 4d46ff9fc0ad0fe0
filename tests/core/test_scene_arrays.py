"""What kernels take of a scene, and points on triangles by closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from photon_bake.addon.scene import Channel, Materials, RayKind, Textures
from photon_bake.tests.core.scenes import plane, scene_of

ZERO = np.zeros(1, np.int32)


def triangle(**columns):
    """The half of a unit square: a, b and c at (0, 0), (1, 0) and (0, 1)."""
    scene = scene_of(np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), [[0, 1, 2]])
    return replace(scene, **columns)


def test_kernels_take_a_scene_s_own_arrays():
    """Of what is large there is no copy, unless it is read-only, for which a kernel would be compiled anew."""
    scene = triangle()
    assert np.shares_memory(scene.arrays.vertices, scene.vertices)
    scene.vertices.flags.writeable = False
    copied = replace(scene).arrays.vertices
    assert copied.flags.writeable and np.array_equal(copied, scene.vertices)


def test_arrays_of_a_light_group_emit_as_it_does():
    scene = triangle()
    dark = scene.lit_by(np.zeros(0, bool), np.zeros(len(scene.objects.names), bool), scene.world)
    assert scene.arrays.emits.all() and not dark.arrays.emits.any()
    assert dark.arrays.vertices is scene.arrays.vertices


def test_each_kind_of_ray_has_its_row():
    scene = triangle()
    scene.objects.seen_through_glass[0] = False
    assert scene.arrays.seen_by[:, 0].tolist() == [kind != RayKind.TRANSMITTED for kind in RayKind]


def test_shading_normals_are_interpolated_and_turn_with_the_side():
    leaning = np.float32([[[0, 0, 1], [0.6, 0, 0.8], [0, 0.6, 0.8]]])
    scene = triangle(corner_normals=leaning)
    u, v, up = np.float32([0.5]), np.float32([0.25]), scene.normals
    expected = np.float32([0.3, 0.15, 0.25 + 0.75 * 0.8])
    expected /= np.linalg.norm(expected)
    np.testing.assert_allclose(scene.shading_normals(ZERO, u, v, up)[0], expected, rtol=1e-6)
    np.testing.assert_allclose(scene.shading_normals(ZERO, u, v, -up)[0], -expected, rtol=1e-6)


def test_flat_triangles_are_shaded_by_their_own_normal():
    scene = triangle()
    up = np.float32([[0.6, 0, 0.8]])  # whatever the caller has
    assert np.array_equal(scene.shading_normals(ZERO, np.float32([0.3]), np.float32([0.3]), up), up)


@pytest.mark.parametrize(
    "extends, uv, texel",
    [
        (False, (0.25, 0.75), 2),
        (False, (1.25, -0.25), 2),  # repeats
        (True, (1.25, -0.25), 1),  # goes on with its edges
        (True, (1.0, 1.0), 3),
        (False, (0.75, 0.25), 1),
        (False, (np.nan, 0.75), 2),  # as at 0: a kernel reads whatever its index says
        (True, (np.inf, np.nan), 1),
        (False, (np.inf, 0.75), 2),
    ],
)
def test_textures_give_the_nearest_texel(extends, uv, texel):
    image = np.arange(12, dtype=np.float32).reshape(2, 2, 3)
    channel = Channel(np.float32([[1, 2, 3]]), np.zeros(1, np.int32))
    materials = Materials.of(1, diffuse=channel, textures=Textures.pack([image], [extends]))
    scene = triangle(materials=materials, corner_uvs=np.tile(np.float32(uv), (1, 3, 1)))
    color = scene.albedo(ZERO, np.float32([0.2]), np.float32([0.2]))
    np.testing.assert_allclose(color[0], image.reshape(4, 3)[texel] * [1, 2, 3])


def test_barycentrics_undo_points_and_stay_on_the_triangle():
    scene = scene_of(*plane())
    random = np.random.default_rng(1)
    u = random.random(100, np.float32)
    v = random.random(100, np.float32) * (1 - u)
    of = random.integers(0, 2, 100).astype(np.int32)
    places = scene.points(of, u, v)
    np.testing.assert_allclose(scene.barycentrics(of, places), [u, v], atol=1e-6)
    outside = scene.barycentrics(ZERO, np.float32([[100, -100, 3]]))
    assert all(0 <= w <= 1 for w in np.concatenate(outside)) and sum(outside)[0] <= 1
