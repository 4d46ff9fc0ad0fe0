"""The nearest of points with normals."""

import numpy as np
import pytest
from photon_bake.addon.core.compiling import kernel
from photon_bake.addon.core.nearest import PointTree, find_nearest, new_search
from photon_bake.addon.core.vec3 import row

pytestmark = pytest.mark.plain


@kernel
def nearest_of_all(tree, search, position, normal, nearly, number, distance2):
    for i in range(len(position)):
        find_nearest(tree, search, row(position, i), row(normal, i), nearly)
        for j in range(len(search.number)):
            number[i, j], distance2[i, j] = search.number[j], search.distance2[j]


def nearest(tree, position, normal, k, nearly=1.0):
    number, distance2 = np.zeros((len(position), k), np.int32), np.zeros((len(position), k), np.float32)
    nearest_of_all(tree, new_search(k), position, normal, np.float32(nearly), number, distance2)
    return number, np.sqrt(distance2)


def points(n, seed):
    """On the sides of a box, whose normals are alike on each."""
    random = np.random.default_rng(seed)
    position, normal = random.uniform(-1, 1, (n, 3)).astype(np.float32), np.zeros((n, 3), np.float32)
    axis, side = random.integers(0, 3, n), random.choice(np.float32([-1, 1]), n)
    position[np.arange(n), axis], normal[np.arange(n), axis] = side, side
    return position, normal


@pytest.mark.parametrize(("n", "k"), [(1, 1), (7, 7), (300, 12)])
def test_nearest_are_those_of_all(n, k):
    at, turn = points(60, 2), 0.7
    tree = PointTree.of(*points(n, 1), turn)
    places, asked = (np.concatenate([p, np.float32(turn) * up], axis=1) for p, up in (points(n, 1), at))
    distance = np.linalg.norm(asked[:, None] - places[None], axis=2)
    number, found = nearest(tree, *at, k)
    assert found == pytest.approx(np.sort(distance, axis=1)[:, :k], abs=1e-6)
    assert np.take_along_axis(distance, number.astype(int), 1) == pytest.approx(found, abs=1e-6)
    rough = nearest(tree, *at, k, nearly=1.3**2)[1]
    assert (rough <= 1.3 * found + 1e-6).all()


def test_points_in_one_place_and_points_ever_closer():
    """Trees stay as deep as the search can hold, though no plane parts the points in halves."""
    same = np.zeros((100, 3), np.float32)
    assert nearest(PointTree.of(same, same, 1.0), same[:2], same[:2], 12)[1].max() == 0
    closer = np.column_stack([2.0 ** -np.arange(120), np.zeros((120, 2))]).astype(np.float32)
    number, _ = nearest(PointTree.of(closer, np.zeros_like(closer), 1.0), closer[:60], np.zeros_like(closer[:60]), 1)
    assert np.array_equal(number[:, 0], np.arange(60))
