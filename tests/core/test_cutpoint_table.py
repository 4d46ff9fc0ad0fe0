"""Cells drawn by their chances."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from photon_bake.addon.core.compiling import kernel
from photon_bake.addon.core.sampling.cutpoint_table import cutpoint_table, drawn_place
from photon_bake.addon.core.sampling.streams import stream
from photon_bake.tests.core.scenes import chi_square
from scipy import stats

pytestmark = pytest.mark.plain

N = 100_000


@kernel
def draw(table, row, u, cell, within):
    for i in range(len(u)):
        cell[i], within[i] = drawn_place(table, row[i], u[i])


def drawn(cumulative, row, u):
    """Cells of rows (n,) by numbers (n,), and where in them the numbers lie."""
    cell, within = np.empty(len(u), np.int64), np.empty(len(u))
    draw(cutpoint_table(cumulative), np.broadcast_to(row, len(u)).astype(np.int64), u.astype(np.float64), cell, within)
    return cell, within


def cumulative(chances):
    return np.cumsum(chances, axis=-1) / np.sum(chances, axis=-1, keepdims=True)


@pytest.fixture
def u():
    return stream(3, 4).random(N)


def test_cells_come_by_their_chances(u):
    chances = np.array([[0, 3, 1, 0, 0, 6], [1, 1, 1, 1, 1, 1]])
    for row, of_row in enumerate(chances):
        counts = np.bincount(drawn(cumulative(chances), row, u)[0], minlength=6)
        some = of_row > 0
        assert not counts[~some].any()
        assert chi_square(counts[some], (of_row / of_row.sum() * N)[some]) > 1e-3


def test_places_within_cells_are_even(u):
    cell, within = drawn(cumulative(np.array([[1.0, 5, 2]])), 0, u)
    for one in range(3):
        assert stats.kstest(within[cell == one], "uniform").pvalue > 1e-3


@given(
    hnp.arrays(float, hnp.array_shapes(min_dims=2, max_dims=2, max_side=40), elements=st.floats(0, 1)),
    hnp.arrays(np.float32, 50, elements=st.floats(0, 1, exclude_max=True, width=32)),
)
def test_the_table_changes_nothing(chances, u):
    chances[:, 0] += 1e-3
    sums = cumulative(chances)
    sums[:, -1] = 1
    row = np.arange(50) % len(chances)
    expected = [np.searchsorted(sums[k] + k, k + np.float64(x), side="right") for k, x in zip(row, u, strict=True)]
    np.testing.assert_array_equal(drawn(sums, row, u)[0], np.minimum(expected, chances.shape[1] - 1))
