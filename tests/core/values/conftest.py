"""Functions of kernels called one by one: as plain Python alone, NUMBA_DISABLE_JIT=1, as `make test-plain` runs them.

Each is quick enough for `make mutants` to count.
"""

import pytest
from photon_bake.addon.core.compiling import jit
from photon_bake.addon.core.sampling.sobol import fixed_points
from photon_bake.addon.emitters import mesh, source

collect_ignore_glob = ["*/test_*.py"] if jit() else []


def pytest_itemcollected(item):
    item.add_marker("plain")


@pytest.fixture(autouse=True)
def few_points(monkeypatch):
    """By few points sources tell their power, and what textured triangles emit: thousands take long as plain Python."""
    monkeypatch.setattr(source, "_points_for_power", lambda: fixed_points(64, 5))
    monkeypatch.setattr(mesh, "_N_POINTS", 64)
