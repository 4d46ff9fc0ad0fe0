"""Photons are stored in little more memory than they take."""

import tracemalloc
from dataclasses import fields

import numpy as np
import pytest
from photon_bake.addon.photons import Photons
from photon_bake.addon.photons.store import PhotonStore


def numbered(n):
    """n photons that differ in every column."""
    columns = [np.array(getattr(Photons.none(), f.name)) for f in fields(Photons)]
    for column in columns:
        column.resize((n, *column.shape[1:]), refcheck=False)
        column[:] = (np.arange(n) % 200).reshape(-1, *[1] * (column.ndim - 1))
    return Photons(*columns)


@pytest.mark.parametrize("sizes", [[], [0], [3, 0, 5], [1000] * 9, [0, 0, 1, 10, 100, 1000]])
def test_what_is_stored_comes_back_in_order(sizes):
    store = PhotonStore()
    for i, n in enumerate(sizes, 1):
        store.add(numbered(n), i / len(sizes))
    photons = store.photons()
    assert len(photons) == sum(sizes)
    for f in fields(Photons):
        expected = np.concatenate([getattr(Photons.none(), f.name), *(getattr(numbered(n), f.name) for n in sizes)])
        np.testing.assert_array_equal(getattr(photons, f.name), expected)


def test_rows_that_are_not_counted_are_not_stored():
    store = PhotonStore()
    store.rows(10).path[:3] = [5, 6, 7]
    store.n = 2
    assert store.photons().path.tolist() == [5, 6]


def test_a_million_photons_take_60_bytes_each_at_the_most():
    part, store = numbered(1 << 15), PhotonStore()
    tracemalloc.start()
    for i in range(40):
        store.add(part, (i + 1) / 40)
    photons = store.photons()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(photons) == 40 << 15 and peak < 60 * len(photons)
