"""The tables of what GGX lobes reflect in all."""

from hashlib import sha256

import numpy as np
from photon_bake.addon.bsdf import albedo_tables
from photon_bake.tools.albedo_tables import tables as computed_tables


def test_tables_are_what_the_formulas_say():
    stored = np.load(albedo_tables.FILE)
    for name, table in computed_tables().items():
        np.testing.assert_allclose(stored[name], table, rtol=1e-4, atol=1e-6)
    assert sha256(albedo_tables.FILE.read_bytes()).hexdigest() == albedo_tables.FILE_DIGEST


def test_tables_have_converged():
    stored, fine = np.load(albedo_tables.FILE), computed_tables(1597, 987)
    for name, table in fine.items():
        off = np.abs(stored[name] - table)
        assert off.max() < 5e-3 and off.mean() < 5e-4
