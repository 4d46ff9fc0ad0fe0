"""Surface elements: found again, evenly sampled, covering everything."""

import numpy as np
import pytest
from photon_bake.addon.core.compiling import kernel
from photon_bake.addon.core.z_curve import z_curve
from photon_bake.addon.gather.radiance_cache.elements import SurfaceCells, SurfaceElements, point_on
from photon_bake.tests.core.scenes import plane, scene_of
from scipy import stats


def soup_scene(n=300):
    """Triangles of very different sizes."""
    random = np.random.default_rng(5)
    size = 10 ** random.uniform(-3, 0, (n, 1, 1))
    corners = random.uniform(-1, 1, (n, 1, 3)) + size * random.uniform(-1, 1, (n, 3, 3))
    return scene_of(corners.reshape(-1, 3), np.arange(3 * n))


def elements_by(scene, visits, n_elements):
    """Elements of cells that are visited evenly."""
    cells = SurfaceCells.by_visits(scene, visits, n_elements)
    return SurfaceElements.by_visits(scene, cells, (visits / cells.cuts**2)[cells.triangle], n_elements)


@pytest.fixture
def elements():
    scene = soup_scene()
    visits = np.random.default_rng(6).integers(0, 100, scene.n_triangles)
    visits[:5] = 2000
    return elements_by(scene, visits, 2000)


def drawn_points(elements, element, seed):
    """Points uniform by area on elements: triangle, u, v."""
    numbers = np.random.default_rng(seed).random((len(element), 3), np.float32)
    triangle, (u, v) = np.empty(len(element), np.int32), np.empty((2, len(element)), np.float32)
    _draw(elements.arrays, element, numbers, triangle, u, v)
    return triangle, u, v


@kernel
def _draw(elements, element, numbers, triangle, u, v):
    for k in range(len(element)):
        triangle[k], u[k], v[k] = point_on(elements, element[k], numbers[k, 0], numbers[k, 1], numbers[k, 2])


def test_what_is_sampled_is_found(elements):
    element = np.repeat(np.arange(len(elements)), 20)
    triangle, u, v = drawn_points(elements, element, 7)
    assert (u >= 0).all() and (v >= 0).all() and (u + v <= 1 + 1e-5).all()
    # Rounding may carry a point over its element's edge.
    assert (elements.find(triangle, u, v) == element).mean() > 0.9995


def test_cut_triangle_is_sampled_evenly():
    scene = scene_of(*plane())
    elements = elements_by(scene, np.array([50, 50]), 50)
    assert len(elements) == 2 * 25
    random = np.random.default_rng(8)
    u, v = random.random((2, 100_000), np.float32)
    u, v = np.where(u + v > 1, [1 - u, 1 - v], [u, v]).astype(np.float32)
    counts = np.bincount(elements.find(np.zeros(100_000, np.int32), u, v), minlength=50)[:25]
    assert stats.chisquare(counts).pvalue > 1e-3


def test_areas_add_up(elements):
    scene = soup_scene()
    assert elements.areas.sum() == pytest.approx(scene.areas.sum())
    assert (elements.areas > 0).all()


def test_number_of_elements_is_about_what_was_asked(elements):
    assert 1000 < len(elements) < 3000


def test_groups_keep_objects_and_sides_apart():
    """Small triangles share elements with their own object's, facing the same way, only."""
    scene = soup_scene(1000)
    object.__setattr__(scene, "object_of_triangle", (np.arange(1000) % 3).astype(np.int32))
    elements = elements_by(scene, np.zeros(1000), 100)
    assert len(elements) < 500
    for of in (scene.object_of_triangle, np.abs(scene.normals).argmax(1)):
        first = np.full(len(elements), -1)
        first[elements.first] = of
        assert np.array_equal(first[elements.first], of)


def test_group_is_sampled_by_area():
    scene = soup_scene(1000)
    object.__setattr__(scene, "object_of_triangle", np.zeros(1000, np.int32))
    elements = elements_by(scene, np.zeros(1000), 100)
    element = np.bincount(elements.first).argmax()
    triangles = np.flatnonzero(elements.first == element)
    assert len(triangles) > 5
    drawn, _, _ = drawn_points(elements, np.full(20_000, element), 9)
    area = elements.cell_areas[triangles]
    counts = np.bincount(drawn, minlength=1000)[triangles]
    enough = 20_000 * area / area.sum() > 5
    expected = area[enough] / area[enough].sum() * counts[enough].sum()
    assert counts.sum() == 20_000 and stats.chisquare(counts[enough], expected).pvalue > 1e-3


def test_flags_of_cells_reach_their_elements(elements):
    flag = np.zeros((len(elements.cuts), 2), bool)
    flag[17, 1] = True
    marked = elements.of_cells(flag)
    n = elements.cuts[17] ** 2
    assert marked[elements.first[17] : elements.first[17] + n, 1].all() and marked.sum() == n


def test_cells_are_found_and_their_points_lie_in_them(elements):
    cells = elements.cells
    assert cells.cuts.max() > 1
    random = np.random.default_rng(10)
    cell = random.integers(0, len(cells), 5000)
    a, b = random.random((2, 5000), np.float32) / 2
    triangle, u, v = cells.points(cell, a, b)
    found, a_found, b_found = cells.find(triangle, u, v)
    assert (found == cell).mean() > 0.9995
    np.testing.assert_allclose(
        np.stack([a_found, b_found])[:, found == cell], np.stack([a, b])[:, found == cell], atol=1e-4
    )


def test_part_of_a_triangle_that_is_seen_gets_the_elements():
    """Of a large plane one corner is seen, as the floor of a house on a plain is."""
    scene = scene_of(*plane(100.0))
    cells = SurfaceCells.by_visits(scene, np.array([1000, 0]), 10_000)
    third = np.full(len(cells), np.float32(1 / 3))
    middle = scene.points(*cells.points(np.arange(len(cells)), third, third))
    seen = (middle[:, 0] < -80) & (middle[:, 1] < -80)
    elements = SurfaceElements.by_visits(scene, cells, np.where(seen, 10, 0), 10_000)
    areas = elements.areas[elements.of_cells(seen)]
    assert areas.mean() < 0.1 * elements.areas.mean()


def test_no_triangle_is_an_element_of_its_own(elements):
    nothing = elements.find(np.array([-1], np.int32), np.zeros(1, np.float32), np.zeros(1, np.float32))
    assert nothing[0] == len(elements)


def test_z_curve_keeps_neighbours_together():
    grid = np.stack(np.meshgrid(*[np.arange(8)] * 3, indexing="ij"), -1).reshape(-1, 3).astype(np.float32)
    code = z_curve(grid)
    assert len(np.unique(code)) == 512
    first_half = grid[np.argsort(code)][:256]
    assert first_half[:, 2].max() <= 3
