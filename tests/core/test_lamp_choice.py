"""Which lamps are asked for light, cell by cell; and directions that are stratified by a shifted set of points."""

import numpy as np
import pytest
from photon_bake.addon.core.compiling import jit, kernel
from photon_bake.addon.core.sampling.cutpoint_table import chance_of
from photon_bake.addon.core.sampling.streams import stream
from photon_bake.addon.core.vec3 import row
from photon_bake.addon.emitters.patterns.arrays import pattern_arrays
from photon_bake.addon.gather.direct import lamp_choice as choice
from photon_bake.addon.gather.direct.lamp_choice import cell_of, choose_lamp, lamp_grid
from photon_bake.addon.gather.direct.ray_directions import gather_directions, shifted, stratified_set
from photon_bake.addon.scene import LightKind, Lights
from photon_bake.tests.core.scenes import box, lamp, scene_of

pytestmark = [pytest.mark.plain, pytest.mark.skipif(jit(), reason="runs as plain Python: make test-plain")]
SHARE = 0.25
"""Of the chances that all lamps have alike."""


@kernel
def cells_of(grid, positions, cells):
    for i in range(len(positions)):
        cells[i] = cell_of(grid, row(positions, i))


@kernel
def chances_of(grid, cell, chances):
    for i in range(len(chances)):
        chances[i] = chance_of(grid.table, cell, i)


@kernel
def drawn(grid, cell, u, lamps, chances):
    for i in range(len(u)):
        lamps[i], chances[i] = choose_lamp(grid, cell, u[i])


@kernel
def shift_all(points, a, b, out):
    for k in range(len(points)):
        out[k, 0], out[k, 1] = shifted(points, k, a, b)


def grid_of(*lights, lit=None):
    """The grid of a box from −1 to 1 with lamps."""
    scene = scene_of(*box(), lights=Lights.join(list(lights)))
    chosen = np.ones(len(lights), bool) if lit is None else np.array(lit)
    return scene, lamp_grid(scene, pattern_arrays(scene.lights), chosen)


def test_cells_of_positions():
    """In the order x, y, z; positions outside belong to the nearest."""
    _, grid = grid_of(*(lamp(LightKind.POINT, 1, position=(x, 0, 0)) for x in (-0.5, 0.5)))
    n, low, cell = grid.per_side, np.array(grid.low), np.array(grid.cell)
    assert n == 16 and low == pytest.approx(-1) and cell == pytest.approx(2 / 16)
    steps = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    found = np.empty(len(steps), np.int64)
    cells_of(grid, (low + (steps + 0.5) * cell).astype(np.float32), found)
    assert found.tolist() == list(range(n**3))
    outside = np.empty(4, np.int64)
    cells_of(grid, np.float32([(-9, -9, -9), (9, 9, 9), (9, -9, -9), (-9, -9, 9)]), outside)
    assert outside.tolist() == [0, n**3 - 1, (n - 1) * n * n, n - 1]


def test_lamps_that_fade_are_taken_by_what_is_left():
    """Linear light is d times as strong, d² being that of the cell's middle and half of its size."""
    near, fading = (lamp(LightKind.POINT, 1.0, position=(0.2, 0.1, 0.3), distance_power=k) for k in (0, 1))
    _, grid = grid_of(near, fading)
    found = np.empty(2)
    chances_of(grid, 5, found)
    size = np.array(grid.cell, np.float64)
    middle = np.array(grid.low) + np.array([0.5, 0.5, 5.5]) * size
    d2 = ((middle - (0.2, 0.1, 0.3)) ** 2).sum() + (size**2).sum() / 4
    give = np.array([1, np.sqrt(d2)])
    assert found == pytest.approx(SHARE / 2 + (1 - SHARE) * give / give.sum(), rel=1e-4)


def test_lamps_of_which_none_is_taken():
    _, grid = grid_of(lamp(LightKind.POINT, 0.0), lit=[False])
    assert grid.table.cumulative.tolist() == [0]


def test_many_lamps_have_fewer_cells(monkeypatch):
    """As many a side as leave room for a chance of each lamp in each cell, one at the least."""
    lights = [lamp(LightKind.POINT, 1, position=(x, 0, 0)) for x in np.linspace(-0.5, 0.5, 5)]
    for most, per_side in ((5 * 27, 3), (5 * 26, 2), (4, 1)):
        monkeypatch.setattr(choice, "_MAX_CHANCES", most)
        assert grid_of(*lights)[1].per_side == per_side


def test_one_lamp_is_always_taken():
    _, grid = grid_of(lamp(LightKind.POINT, 1), lamp(LightKind.POINT, 1), lit=[False, True])
    lamps, found = np.empty(8, np.int64), np.empty(8, np.float32)
    drawn(grid, 0, np.linspace(0, 0.999, 8, dtype=np.float32), lamps, found)
    assert grid.per_side == 1 and set(lamps) == {1} and found == pytest.approx(1)


def test_chances_follow_the_irradiance():
    """A quarter of the chance is even; the rest is I/(d² + r²), E of a sun, and L A/(d² + r²)."""
    sun = lamp(LightKind.SUN, 0.5, direction=(0, 0, -1))
    point = lamp(LightKind.POINT, 3.0, position=(0.2, 0.1, 0.3))
    square = lamp(LightKind.RECTANGLE, 2.0, position=(-0.4, 0.5, 0.2), size=(0.5, 0.4))
    _, grid = grid_of(sun, point, square)
    cell, size = np.empty(1, np.int64), np.array(grid.cell, np.float64)
    at = np.array([0.6, -0.3, -0.7])
    cells_of(grid, at[None].astype(np.float32), cell)
    found = np.empty(3)
    chances_of(grid, cell[0], found)
    middle = np.array(grid.low) + (np.floor((at + 1) / size) + 0.5) * size
    least = (size**2).sum() / 4
    d2 = [((middle - place) ** 2).sum() + least for place in ((0.2, 0.1, 0.3), (-0.4, 0.5, 0.2))]
    give = np.array([0.5, 3 / d2[0], 2 * 0.2 / d2[1]])
    assert found == pytest.approx(SHARE / 3 + (1 - SHARE) * give / give.sum(), rel=1e-4)
    n = 4096
    lamps, of_drawn = np.empty(n, np.int64), np.empty(n, np.float32)
    drawn(grid, cell[0], ((np.arange(n) + 0.5) / n).astype(np.float32), lamps, of_drawn)
    assert np.bincount(lamps) / n == pytest.approx(found, abs=2 / n) and of_drawn == pytest.approx(found[lamps])


def test_shifted_points_stay_in_the_square():
    """Each moves by the same, around the torus; 1 is never reached."""
    points, out = stratified_set(64), np.empty((64, 2), np.float32)
    shift_all(points, np.float32(0.3), np.float32(0.85), out)
    assert out == pytest.approx((points + np.float32([0.3, 0.85])) % 1, abs=1e-6)
    edge = np.float32([[1 - 2**-24, 2**-25]])
    shift_all(edge, np.float32(1 - 2**-24), np.float32(1 - 2**-24), out[:1])
    assert (out[0] < 1).all() and out[0, 0] > 0.99


def test_gathered_directions_are_cosine_weighted():
    """The mean of a run is 2/3 of the normal, and of its squares around it a quarter each way."""
    normals = np.repeat(np.float32([[0, 0, 1], [0.6, 0, -0.8]]), 256, axis=0)
    directions = gather_directions(normals, 256, stream(3)).astype(np.float64)
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1, abs=1e-5)
    for run in (slice(0, 256), slice(256, 512)):
        along, normal = directions[run], normals[run][0]
        assert along.mean(axis=0) == pytest.approx(2 / 3 * normal, abs=0.01)
        assert ((along @ normal) ** 2).mean() == pytest.approx(0.5, abs=0.01)
