"""Faces laid flat in charts, and charts packed into images."""

from time import perf_counter

import numpy as np
import pytest
from photon_bake.addon.core.errors import Cancelled
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.receivers.uv_maps import Faces, Piece, fill, pack, unwrapped
from photon_bake.addon.receivers.uv_maps.unwrap import ANGLE


def faces_of(vertices, faces):
    """Faces of lists of vertices, cut into triangles around their first corner."""
    n_corners = np.array([len(face) for face in faces], np.int32)
    first = np.cumsum(n_corners) - n_corners
    triangles = [(s, s + i, s + i + 1) for s, n in zip(first, n_corners, strict=True) for i in range(1, n - 1)]
    corners = np.concatenate(faces).astype(np.int32)
    return Faces(np.array(vertices, np.float32), corners, n_corners, np.array(triangles, np.int32))


def grid(n, height=lambda x, y: 0 * x):
    """A surface over the unit square in n × n squares."""
    y, x = np.mgrid[: n + 1, : n + 1] / n
    number = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    squares = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=2)
    return faces_of(np.stack([x, y, height(x, y)], axis=2).reshape(-1, 3), list(squares.reshape(-1, 4)))


def cube():
    corners = [(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    return faces_of(corners, [(3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)])


def spiral(turns, n):
    """A ramp around an axis, whose turns lie over each other."""
    angle = np.linspace(0, 2 * np.pi * turns, n + 1)
    inner = np.stack([np.cos(angle), np.sin(angle), 0.05 * angle], axis=1)
    return faces_of(np.concatenate([inner, inner * (2, 2, 1)]), [(i, n + 1 + i, n + 2 + i, i + 1) for i in range(n)])


def n_charts(piece):
    return len(np.unique(piece.chart))


def flat_cross(a, b):
    """a × b of vectors in a plane, which NumPy no longer knows."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def share_twice(packed, faces):
    """Share of an image's points on triangles that lie on two of them, by points at random."""
    a, b, c = np.moveaxis(packed.uv[0][faces.triangles].astype(float), 1, 0)
    points = np.random.default_rng(0).random((4000, 2))

    def side(p, q):
        return flat_cross((q - p)[:, None], points[None] - p[:, None])

    sides = np.stack([side(a, b), side(b, c), side(c, a)])
    inside = ((sides > 1e-9).all(axis=0) | (sides < -1e-9).all(axis=0)).sum(axis=0)
    return (inside > 1).sum() / max((inside > 0).sum(), 1)


def test_a_cube_has_six_charts_of_its_size():
    piece = unwrapped(cube())
    assert n_charts(piece) == 6 and piece.area == pytest.approx(6, rel=1e-5)
    packed = pack([piece], 16, 1)
    assert packed.width * packed.height < 6 * 20**2 * 1.1  # 16 texels and a ring each, in blocks of 4


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_a_rectangle_lies_straight_and_ends_with_texels(turn):
    corners = np.array([(0, 0), (3, 0), (3, 1), (0, 1)]) @ np.array(
        [(np.cos(turn), np.sin(turn)), (-np.sin(turn), np.cos(turn))]
    )
    faces = faces_of(np.column_stack([corners, np.zeros(4)]), [(0, 1, 2, 3)])
    packed = pack([unwrapped(faces)], 8, 1)
    assert sorted((packed.width, packed.height)) == [12, 28]  # 24 × 8 texels, a ring around them, in blocks of 4
    texels = packed.uv[0] * (packed.width, packed.height)
    np.testing.assert_allclose(texels, np.rint(texels), atol=0.01)
    assert sorted(np.ptp(texels, axis=0)) == pytest.approx([8, 24], abs=0.01)


def test_smooth_surfaces_are_one_chart():
    bump = grid(24, lambda x, y: 0.12 * np.sin(5 * x) * np.cos(4 * y))
    assert n_charts(unwrapped(bump)) == 1


def test_no_face_is_steeper_to_its_chart_than_the_angle():
    """A ball: Charts are seen from near enough for texels not to be stretched beyond measure."""
    n = 24
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, n + 1), np.linspace(0, np.pi, n + 1))
    ball = grid(n)
    places = np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)], axis=2).reshape(-1, 3)
    ball = Faces(places.astype(np.float32), ball.corner_vertex, ball.n_corners, ball.triangles)
    piece = unwrapped(ball)
    flat = np.abs(flat_cross(*np.moveaxis(piece.uv[ball.triangles][:, 1:] - piece.uv[ball.triangles][:, :1], 1, 0))) / 2
    corners = ball.corners()
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    real = area > 1e-6
    assert 4 <= n_charts(piece) <= 16 and (flat[real] / area[real]).min() > 0.7 * np.cos(ANGLE)


@pytest.mark.parametrize("turns", [2, 7])
def test_turns_of_a_spiral_lie_beside_each_other(turns):
    ramp = spiral(turns, 30 * turns)
    piece = unwrapped(ramp)
    assert n_charts(piece) <= 3 * turns
    assert share_twice(pack([piece], 32, 1), ramp) == 0


def test_faces_that_repeat_lie_beside_each_other():
    vertices = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    twice = faces_of(vertices, [(0, 1, 2, 3), (0, 1, 2, 3), (0, 3, 2, 1)])
    assert share_twice(pack([unwrapped(twice)], 32, 1), twice) == 0


def test_broken_faces_are_laid_flat_all_the_same():
    """Vertices that repeat, no area, the same triangle over and over: what froze another unwrapper."""
    vertices = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0, 0)]
    broken = faces_of(vertices, [(0, 0, 1), (0, 1, 0, 1), (0, 4, 1), (2, 2, 2), (0, 1, 2, 3), *[(0, 1, 2)] * 40])
    piece = unwrapped(broken)
    packed = pack([piece], 16, 1)
    assert np.isfinite(packed.uv[0]).all() and packed.uv[0].min() >= 0 and packed.uv[0].max() <= 1
    assert share_twice(packed, broken) == 0


def test_nothing_overlaps_in_an_image_of_many_pieces():
    pieces = [unwrapped(grid(8, lambda x, y, k=k: k / 9 * np.sin(7 * x * y))) for k in range(20)]
    pieces += [Piece.rectangle(0.1 * i, 2 / i) for i in range(1, 20)]
    packed = pack(pieces, 24, 1)
    taken = np.zeros((packed.height, packed.width), int)
    for piece, uv in zip(pieces, packed.uv, strict=True):
        if not piece.turns:  # rectangles are known whole
            corners = uv * (packed.width, packed.height)
            (left, low), (right, high) = np.floor(corners.min(axis=0)), np.ceil(corners.max(axis=0))
            taken[int(low) : int(high), int(left) : int(right)] += 1
    assert taken.max() == 1
    assert sum(piece.area for piece in pieces) * 24**2 > 0.45 * taken.size


def test_an_image_of_a_size_is_filled_or_refused():
    pieces = [unwrapped(cube()) for _ in range(5)]
    packed = fill(lambda _: pieces, 128, 1)
    assert (packed.width, packed.height) == (128, 128)
    assert sum(piece.area for piece in pieces) * packed.density**2 > 0.5 * 128**2
    assert pack(pieces, 1.1 * packed.density, 1, 128) is None
    assert fill(lambda _: pieces, 16, 1) is None  # 30 charts of a block or more


def test_a_line_fits_into_an_image_of_a_size():
    """A surface almost without area is as long as the image, whatever the density its area would ask for."""
    assert fill(lambda _: [Piece.rectangle(10.0, 1e-7)], 64, 1).density > 3


def test_the_same_comes_out_again():
    first, second = (pack([unwrapped(spiral(5, 150))], 24, 1).uv[0] for _ in range(2))
    assert np.array_equal(first, second)


def test_both_can_be_cancelled_at_once():
    faces = grid(500, lambda x, y: 0.3 * np.sin(40 * x) * np.sin(40 * y))
    piece = unwrapped(grid(8))
    for work in (lambda check: unwrapped(faces, check), lambda check: pack([piece], 300, 1, check=check)):
        progress, started = Progress(), perf_counter()
        progress.cancel()
        with pytest.raises(Cancelled):
            work(progress.check)
        assert perf_counter() - started < 2
