"""Photons of a source at single points of its hypercube, as plain Python."""

import numpy as np
import pytest
from photon_bake.addon.emitters.emission import emit
from photon_bake.addon.emitters.source import emitters_of

POINTS = np.random.default_rng(3).random((14, 5), dtype=np.float32)


def emitted(source, points=POINTS):
    """Origin, direction, flux and object of each point's photon, in double precision."""
    emitters = emitters_of([source])
    for u in points:
        origin, direction, flux, object_ = emit(emitters, 0, *u)
        assert np.linalg.norm(direction) == pytest.approx(1, abs=1e-5)
        yield u, np.float64(origin), np.float64(direction), np.float64(flux), object_
