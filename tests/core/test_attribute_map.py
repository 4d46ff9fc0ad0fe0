"""What modifiers make of attributes, and the attribute that shows what is wanted."""

from dataclasses import replace

import numpy as np
from photon_bake.addon.receivers import AttributeMap, ReceiverMesh, joined, unreached_share, vertex_receivers
from photon_bake.addon.receivers.attribute_map import N_PLACES


def map_of(matrix, area=None):
    """A map from a dense matrix (c, e)."""
    corner, element = np.nonzero(matrix)
    return AttributeMap(
        domain="CORNER",
        area=np.ones(len(matrix), np.float32) if area is None else np.asarray(area, np.float32),
        stand_in=np.arange(matrix.shape[1], dtype=np.int32),
        corner=corner.astype(np.int32),
        element=element.astype(np.int32),
        weight=matrix[corner, element].astype(np.float32),
    )


def test_what_is_shown_once_is_stored():
    wanted = np.random.default_rng(1).uniform(0, 9, (5, 3))
    np.testing.assert_allclose(map_of(np.eye(5)[[3, 1, 4, 0, 2]]).stored(wanted), wanted[[3, 1, 4, 0, 2]], rtol=1e-5)


def test_what_is_shown_in_several_places_is_their_mean_by_area():
    matrix = np.repeat(np.eye(2), 3, axis=0)
    stored = map_of(matrix, [1, 1, 2, 5, 0, 5]).stored(np.array([[1.0], [2], [6], [3], [100], [5]]))
    np.testing.assert_allclose(stored, [[3.75], [4]], rtol=1e-4)


def test_an_inset_face_is_extrapolated():
    """Of a face whose corners are shown 20 % of the way inside, wanted values are met by stored ones farther apart."""
    inside = np.array(
        [[0.64, 0.16, 0.04, 0.16], [0.16, 0.64, 0.16, 0.04], [0.04, 0.16, 0.64, 0.16], [0.16, 0.04, 0.16, 0.64]]
    )
    stored = np.array([[0.0, 1], [1, 1], [1, 2], [0, 2]])
    found = map_of(inside)
    np.testing.assert_allclose(found.stored(inside @ stored), stored, atol=1e-4)
    np.testing.assert_allclose(found.shown(stored), inside @ stored, atol=1e-6)


def test_what_no_corner_shows_takes_its_stand_ins_value():
    found = replace(map_of(np.eye(3)[:2]), stand_in=np.array([0, 1, 1], np.int32))
    np.testing.assert_allclose(found.stored(np.array([[2.0], [7]])), [[2], [7], [7]], rtol=1e-5)


def test_share_of_the_surface_without_light():
    found = map_of(np.array([[1.0], [0], [1]]), [1, 2, 5])
    np.testing.assert_array_equal(found.reached, [True, False, True])
    np.testing.assert_allclose(unreached_share([found]), 0.25)
    np.testing.assert_allclose(unreached_share([found, map_of(np.array([[0.0], [1], [0]]))]), 0)


def test_misplaced_light():
    """Two places one radius from their middle show the mean; one that turns has normals of its own."""
    places, up = np.array([[1.0, 0, 0], [-1, 0, 0]]), np.array([[0, 0, 1.0]] * 2)
    twice = map_of(np.ones((2, 1)))
    assert map_of(np.eye(2)).with_misplaced(places, up).misplaced < 1e-4
    np.testing.assert_allclose(twice.with_misplaced(places, up).misplaced, 1, rtol=1e-4)
    np.testing.assert_allclose(twice.with_misplaced(places * 0, up * [[1], [-1]]).misplaced, 1, rtol=1e-4)


def test_a_few_places_decide():
    """Of a face that is cut finely, the corners that count most alone get receivers; the values are the same."""
    n, rng = 200, np.random.default_rng(3)
    where = rng.uniform(0, 1, (n, 2))
    (x, y), one = where.T, np.ones(n)
    matrix = np.column_stack([(one - x) * (one - y), x * (one - y), x * y, (one - x) * y])
    found = map_of(matrix)
    decisive = found.decisive()
    assert 4 <= decisive.sum() <= 4 * N_PLACES
    light = np.array([[1.0], [2], [5], [3]])
    np.testing.assert_allclose(found.stored(matrix @ light, decisive), light, rtol=1e-3)
    positions = np.column_stack([where, 0 * x]).astype(np.float32)
    corner = np.arange(n, dtype=np.int32)
    mesh = ReceiverMesh("O", "M", "CORNER", positions, np.tile([[0, 0, 1]], (n, 1)), corner, corner // 4, found)
    receivers = vertex_receivers([mesh])
    assert len(receivers) == decisive.sum()
    (target,) = receivers.targets
    assert target.n_elements == 4
    np.testing.assert_allclose(target.values(np.ones((len(receivers), 3))), 1, rtol=1e-4)
    copied = replace(mesh, map=replace(found, misplaced=1.0))
    assert len(vertex_receivers([copied])) == n


def test_parts_that_show_one_mesh_are_solved_together():
    """Two objects show a stored mesh's two corners each, half of them the same: the shared one has the mean."""

    def part(elements):
        matrix = np.eye(3)[elements]
        positions = np.zeros((2, 3), np.float32)
        whole = np.arange(2, dtype=np.int32)
        found = replace(map_of(matrix), stand_in=np.array([1, 1, 1], np.int32))
        return ReceiverMesh("O", "M", "POINT", positions, np.tile([[0, 0, 1.0]], (2, 1)), whole, whole * 0, found)

    mesh = joined([part([0, 1]), part([1, 2])])
    np.testing.assert_array_equal(mesh.corner_vertex, [0, 1, 2, 3])
    np.testing.assert_array_equal(mesh.corner_face, [0, 0, 1, 1])
    np.testing.assert_array_equal(mesh.map.stand_in, [0, 1, 2])
    np.testing.assert_allclose(mesh.map.stored(np.array([[1.0], [2], [4], [5]])), [[1], [3], [5]], rtol=1e-4)
