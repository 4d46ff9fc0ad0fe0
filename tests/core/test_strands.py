"""Hair as tubes and points as balls: their shape, their area, and what is bad about them."""

import numpy as np
import pytest
from photon_bake.addon.scene.fibres import balls, strands
from photon_bake.addon.scene.fibres.balls import Balls, octahedron, swelling
from photon_bake.addon.scene.fibres.strands import Strands, Tubes, thinned, wanted_segments


def strands_of(*curves, radii=None):
    """Strands of some curves (k, 3), of a radius of 0.1 where none is given."""
    sizes = [len(curve) for curve in curves]
    positions = np.concatenate([np.asarray(curve, np.float32).reshape(-1, 3) for curve in curves])
    radii = np.full(len(positions), 0.1) if radii is None else np.concatenate(radii)
    start, uvs = np.concatenate([[0], np.cumsum(sizes)]), {"": np.zeros((len(sizes), 2), np.float32)}
    return Strands(positions, radii.astype(np.float32), start, uvs, np.zeros(len(sizes), np.float32))


def triangles_of(shape):
    """Corners (t, 3, 3) of a shape's triangles."""
    return shape.vertices(shape.outward())[shape.triangles()].astype(np.float64)


def normals_of(corners):
    """Vectors along the triangles' normals, of their areas' lengths."""
    a, b, c = corners.transpose(1, 0, 2)
    return np.cross(b - a, c - a) / 2


def arc(n):
    angle = np.linspace(0, np.pi / 2, n)
    return np.stack([np.cos(angle), np.sin(angle), np.zeros(n)], axis=1)


@pytest.mark.parametrize("n", [1, 1_000, 40_000])
def test_straight_tubes_block_as_cylinders_do(n):
    """Mean projected area over directions is a quarter of the surface; the cylinder's without ends is 2πrl / 4."""
    tubes = Tubes.of(strands_of(*[[(0, 0, 0), (0, 0, 1)]] * n))
    normals = normals_of(triangles_of(tubes))
    assert tubes.n_triangles == len(normals)
    assert np.linalg.norm(normals, axis=1).sum() == pytest.approx(n * 2 * np.pi * 0.1, rel=1e-5)


@pytest.mark.parametrize("n", [5, 9, 30])
def test_bent_tubes_have_the_area_of_their_curve(n):
    tubes = Tubes.of(strands_of(arc(n)))
    area = np.linalg.norm(normals_of(triangles_of(tubes)), axis=1).sum()
    assert area == pytest.approx(2 * np.pi * 0.1 * np.pi / 2, rel=0.01)


def test_normals_point_outward():
    for one in (arc(9), [(0, 0, 0), (0, 0, 1)], [(0, 0, 0), (0, -2, 0)]):
        tubes = Tubes.of(strands_of(one))
        outward, triangles = tubes.outward(), tubes.triangles()
        normals = normals_of(triangles_of(tubes))
        middle = outward[triangles].mean(axis=1)
        assert (np.einsum("ij,ij->i", normals, middle) >= 0).all()


@pytest.mark.parametrize("n", [1, 60_000])
def test_closed_tubes_have_ends(n):
    """Closed bodies: their normals add up to nothing."""
    tubes = Tubes.of(strands_of(*[[(0, 0, 0), (0, 0.2, 1)]] * n), closed=True)
    normals = normals_of(triangles_of(tubes))
    assert len(normals) == tubes.n_triangles
    assert normals.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-6 * n)
    around = normals_of(triangles_of(Tubes.of(strands_of([(0, 0, 0), (0, 0.2, 1)]))))
    assert np.abs(np.einsum("ij,j->i", around, [0, 0.2, 1])).max() < 1e-6


def test_tubes_are_turned_at_random():
    """A prism's faces look to every side equally often, so that many scatter as cylinders do."""
    tubes = Tubes.of(strands_of(*[[(0, 0, 0), (0, 0, 1)]] * 50_000))
    assert tubes.sides == 3
    normals = normals_of(triangles_of(tubes))
    angle = np.arctan2(normals[:, 1], normals[:, 0])
    for k in (1, 2, 3, 6):
        assert abs(np.exp(1j * k * angle).mean()) < 0.02


def test_straight_strands_need_one_segment():
    strand = strands_of(np.linspace([0, 0, 0], [0, 0, 1], 9))
    assert wanted_segments(strand).tolist() == [1]
    assert wanted_segments(strands_of(arc(5))).tolist() == [4]


def test_curves_are_those_of_catmull_and_rom():
    """Halfway between the middle keys: (−a + 9 b + 9 c − d) / 16; with the last key twice, (−a + 9 b + 8 c) / 16."""
    strand = strands_of([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    at, _ = strands._curve(strand, np.zeros(2, int), np.array([0.5, 5 / 6]), False)
    assert at == pytest.approx(np.array([[18 / 16, 8 / 16, 0], [8 / 16, 17 / 16, 0]]))
    at, _ = strands._curve(strand, np.zeros(2, int), np.array([0.5, 5 / 6]), True)
    assert at == pytest.approx(np.array([[1, 0.5, 0], [0.5, 1, 0]]))


def test_bad_strands_are_left_out():
    curves = [[(0, 0, 0)], [], [(0, 0, 0), (np.nan, 0, 0)], [(1, 1, 1)] * 3, [(0, 0, 0), (0, 0, 1)]]
    curves += [[(0, 0, 0), (0, 1, 0)]] * 3
    radii = [np.full(len(curve), 0.1) for curve in curves[:5]] + [np.zeros(2), np.array([-1, 1]), np.array([1, np.inf])]
    whole = strands_of(*curves, radii=radii).whole()
    assert len(whole) == 1
    assert whole.positions.tolist() == [[0, 0, 0], [0, 0, 1]]
    assert len(strands_of([(0, 0, 0)]).whole()) == 0


def test_nothing_makes_no_triangles():
    tubes = Tubes.of(strands_of([(0, 0, 0)]).whole())
    assert tubes.n_triangles == len(tubes.triangles()) == tubes.n_vertices == len(tubes.outward()) == 0


def test_triangles_are_bounded_at_the_same_area():
    strand = strands_of(*[arc(20)] * 100)
    tubes = Tubes.of(strand, most=1_300)
    area = np.linalg.norm(normals_of(triangles_of(tubes)), axis=1).sum()
    assert tubes.sides == 3 and tubes.n_triangles <= 1_300
    assert area == pytest.approx(100 * 2 * np.pi * 0.1 * np.pi / 2, rel=0.02)


def test_thinned_takes_one_of_each_stretch():
    assert thinned(5, 10).tolist() == list(range(5))
    kept = thinned(1000, 100)
    assert (kept // 10).tolist() == list(range(100))


def test_strands_share_their_length():
    tubes = Tubes.of(strands_of([(0, 0, 0), (0, 0, 1), (0, 3, 1)]), straight=True)
    assert tubes.along.tolist() == [0, 0.25, 1]


@pytest.mark.parametrize("cuts", [0, 1, 2, 3])
def test_balls_have_their_spheres_surface(cuts):
    """By Cauchy's formula a quarter of it is seen in the mean, πr²."""
    vertices, faces = octahedron(cuts)
    normals = normals_of(swelling(cuts) * vertices[faces])
    assert len(faces) == 8 * 4**cuts
    assert np.linalg.norm(normals, axis=1).sum() == pytest.approx(4 * np.pi)
    seen = np.random.default_rng(3).normal(size=(2_000, 3))
    seen /= np.linalg.norm(seen, axis=1, keepdims=True)
    assert np.maximum(normals @ seen.T, 0).sum(axis=0).mean() == pytest.approx(np.pi, rel=0.005)
    assert (np.einsum("ij,ij->i", normals, vertices[faces].mean(axis=1)) > 0).all()


def test_bad_points_are_left_out():
    positions = np.array([[0, 0, 0], [np.nan, 0, 0], [1, 1, 1], [2, 2, 2], [3, 3, 3]], np.float32)
    found = Balls.of(positions, np.array([1, 1, 0, -1, np.nan], np.float32))
    assert len(found) == 1 and found.cuts == balls.MOST_CUTS
    corners = triangles_of(found)
    assert len(corners) == found.n_triangles
    assert np.linalg.norm(corners, axis=2) == pytest.approx(swelling(found.cuts))


def test_many_points_are_octahedra():
    assert Balls.of(np.zeros((100_000, 3), np.float32), np.ones(100_000, np.float32)).cuts == 0
