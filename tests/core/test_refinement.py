"""Meshes refined for light that is known everywhere."""

import numpy as np
import pytest
from photon_bake.addon.core.errors import BakeError, Cancelled
from photon_bake.addon.core.progress import Progress
from photon_bake.addon.pipeline.refinement import Placed, RefineOptions, Triangles, WidePoints, refine


def square(name="Square", mesh="Square", half=4.0, at=(0, 0, 0), n=1):
    """A square of n × n quads that face up, each of two triangles."""
    i, j = (axis.ravel() for axis in np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij"))
    position = np.stack([i, j, 0 * i], axis=1) * (2 * half / n) - np.array([half, half, 0]) + at
    p, q = (axis.ravel() for axis in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    a, b, c, d = (x * (n + 1) + y for x, y in ((p, q), (p + 1, q), (p + 1, q + 1), (p, q + 1)))
    corner = np.stack([a, b, c, a, c, d], axis=1).reshape(-1, 3).astype(np.int32)
    normal = np.broadcast_to(np.array([0, 0, 1], np.float32), (len(corner), 3, 3)).copy()
    polygon, weld = np.arange(len(corner), dtype=np.int32) // 2, np.arange(len(position), dtype=np.int32)
    return Placed(name, mesh, position.astype(np.float32), corner, normal, polygon, weld)


def light_of(function):
    """Light without noise by a function of positions."""

    def light(receivers):
        value = np.repeat(function(receivers.position)[:, None], 3, axis=1).astype(np.float32)
        return value, np.zeros(len(receivers), np.float32)

    return light


def bump(position):
    """A spot of light half a metre wide in a dim square."""
    return 0.5 + np.exp(-((position[:, :2] - [1.5, 0.5]) ** 2).sum(axis=1) / 0.25)


def wide_bump(position):
    return 0.3 + np.exp(-(position[:, :2] ** 2).sum(axis=1) / 6)


def edge_of_shadow(position):
    return np.where(position[:, 0] + 0.3 * position[:, 1] > 0.37, 1.0, 0.2)


def carried_out(mesh, refinement):
    """Triangles after the splits, by a dictionary of edges: what a mesh editor does."""
    position, triangles = mesh.position.astype(np.float64), [tuple(one) for one in mesh.corner.tolist()]
    for a, b in refinement.ends[mesh.mesh_name].tolist():
        m, around = len(position), [one for one in triangles if a in one and b in one]
        assert around, "an edge is split that is not there"
        position = np.concatenate([position, position[[a, b]].mean(axis=0, keepdims=True)])
        for one in around:
            triangles.remove(one)
            triangles += [tuple(m if v == b else v for v in one), tuple(m if v == a else v for v in one)]
    return position, np.array(triangles)


def mean_error(position, triangles, function, n=40_000):
    """Mean difference between light and what vertices say of it, over the area."""
    random = np.random.default_rng(1)
    a, b, c = (position[triangles[:, k]] for k in range(3))
    p, q = (b - a).T, (c - a).T
    area = np.abs(p[0] * q[1] - p[1] * q[0])
    row = random.choice(len(triangles), n, p=area / area.sum())
    u, v = random.random((2, n))
    weight = np.stack([1 - np.sqrt(u), np.sqrt(u) * (1 - v), np.sqrt(u) * v], axis=1)
    at = np.einsum("sc,scd->sd", weight, position[triangles[row]])
    shown = (weight * function(position)[triangles[row]]).sum(axis=1)
    return np.abs(shown - function(at)).mean()


@pytest.mark.parametrize("function", [bump, edge_of_shadow], ids=["spot", "edge of a shadow"])
def test_a_fifth_of_a_grids_error_with_as_many_vertices(function):
    mesh = square()
    refinement = refine([mesh], light_of(function), RefineOptions(0.005, 400), 0, Progress())
    position, triangles = carried_out(mesh, refinement)
    assert len(position) <= 404
    grid = square(n=int(np.sqrt(len(position))) - 1)
    refined, uniform = (
        mean_error(p.astype(np.float64), t, function) for p, t in [(position, triangles), (grid.position, grid.corner)]
    )
    assert refined < uniform / (5 if function is bump else 2)


def test_no_vertex_lies_within_a_neighbours_edge():
    mesh = square(n=3)
    position, triangles = carried_out(mesh, refine([mesh], light_of(bump), RefineOptions(0.01, 300), 0, Progress()))
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, counts = np.unique(sides, axis=0, return_counts=True)
    on_rim = (np.abs(position[edges]) >= 4).all(axis=1).any(axis=1)
    assert (counts[~on_rim] == 2).all() and (counts[on_rim] == 1).all()
    a, b, c = (position[triangles[:, k]] for k in range(3))
    assert np.cross(b - a, c - a)[:, 2].min() > 0 and np.cross(b - a, c - a)[:, 2].sum() / 2 == pytest.approx(64)


def test_light_that_is_linear_needs_no_more_vertices():
    refinement = refine([square()], light_of(lambda p: 5 + p[:, 0] - p[:, 1] / 2), RefineOptions(), 0, Progress())
    assert refinement.n_vertices == 0 and refinement.error < 0.02 and not len(refinement.cut["Square"])


def test_the_tolerance_is_met():
    refinement = refine([square()], light_of(wide_bump), RefineOptions(0.02, 100_000), 0, Progress())
    assert refinement.error < 0.02 < 0.1 < refinement.before and refinement.n_vertices < 500


def test_noise_is_not_taken_for_light():
    random = np.random.default_rng(0)

    def light(receivers):
        value = 1 + 0.1 * random.standard_normal(len(receivers))
        return np.repeat(value[:, None], 3, axis=1).astype(np.float32), np.full(len(receivers), 0.1, np.float32)

    assert refine([square(n=8)], light, RefineOptions(0.05, 10_000), 0, Progress()).n_vertices < 40


def test_objects_that_share_a_mesh_are_refined_once_for_the_worst_of_them():
    far, near = square("Far", at=(50, 0, 0)), square("Near")
    refinement = refine([far, near], light_of(bump), RefineOptions(0.01, 300), 0, Progress())
    assert list(refinement.ends) == ["Square"]
    position, triangles = carried_out(near, refinement)
    assert mean_error(position, triangles, bump) < 0.01


def test_edges_in_one_place_are_split_together():
    """Two squares of one mesh side by side, that share no vertex."""
    left, right = square(at=(-4, 0, 0)), square(at=(4, 0, 0))
    position = np.concatenate([left.position, right.position])
    weld = np.unique(position, axis=0, return_inverse=True)[1].reshape(-1).astype(np.int32)
    corner, polygon = np.concatenate([left.corner, right.corner + 4]), np.array([0, 0, 1, 1], np.int32)
    mesh = Placed("Both", "Both", position, corner, np.concatenate([left.normal, right.normal]), polygon, weld)
    refinement = refine(
        [mesh], light_of(lambda p: bump(p + np.array([2.5, 0, 0]))), RefineOptions(0.01, 200), 0, Progress()
    )
    position, _ = carried_out(mesh, refinement)
    on_seam = position[np.abs(position[:, 0]) < 1e-6]
    assert len(on_seam) > 6
    assert (np.unique(on_seam, axis=0, return_counts=True)[1] == 2).all()


def test_faces_that_are_not_cut_within_are_told_apart():
    mesh = square(n=16)
    refinement = refine([mesh], light_of(bump), RefineOptions(0.02, 60), 0, Progress())
    assert 0 < len(refinement.cut["Square"]) < 60


def test_the_same_seed_gives_the_same_splits():
    first, again = (refine([square()], light_of(bump), RefineOptions(0.02, 200), 3, Progress()) for _ in range(2))
    assert np.array_equal(first.ends["Square"], again.ends["Square"])


def test_it_can_be_cancelled():
    progress = Progress(lambda stage, fraction: progress.cancel() if fraction > 0 else None)
    with pytest.raises(Cancelled):
        refine([square()], light_of(bump), RefineOptions(0.01, 500), 0, progress)


@pytest.mark.parametrize("options", [{"tolerance": 0}, {"tolerance": float("nan")}, {"budget": 0}])
def test_numbers_out_of_range_are_refused(options):
    with pytest.raises(BakeError, match="choose a number from"):
        RefineOptions(**options)


def test_wide_triangles_are_said_to_be_too_coarse():
    meshes = [square("Lit"), square("Plain", "Plain", at=(50, 0, 0))]
    light = light_of(wide_bump)
    samples = WidePoints.of(meshes, 0)
    samples = samples.lit(*light(samples.receivers))
    triangles = Triangles.of(meshes)
    corners = np.repeat(wide_bump(triangles.position[triangles.point.ravel()])[:, None], 3, axis=1)
    names = samples.coarse(corners.reshape(-1, 3, 3), np.zeros((len(triangles), 3)), 0.6, 0.0)
    assert names == ["Lit"]
    assert not samples.coarse(corners.reshape(-1, 3, 3), np.zeros((len(triangles), 3)), 0.6, 2.0)
