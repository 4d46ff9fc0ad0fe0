"""Density estimates at many receivers, most of which take them from the records of a final gather.

Within a way that is short beside its radius, an estimate of k photons changes by less than it is uncertain: nearly the
same photons are around. A dense spot beyond the radius cannot hide between the records either, since fewer than k
photons lie within it.
"""

import numpy as np

from ...core.parallel import Workers
from ...receivers import Receivers
from ..irradiance import Estimate
from ..irradiance_cache import FinalGather
from .density import PhotonDensity

_SHORT = np.float32(1 / 6)
"""A record's cell over the radius there, up to which others take what the record has: they look at records as far as
one and a half cells away, a quarter of the radius."""

_AT_RECORDS = 0.3  # of the stage


def thinned_density(density: PhotonDensity, receivers: Receivers, gather: FinalGather, workers: Workers) -> Estimate:
    """Estimates at n receivers, which are those of a final gather."""
    records, weights = gather.records, gather.weights
    if len(records) == len(receivers):
        return density.at(receivers, workers)[0]
    found, radius = density.at(receivers.where(records.receiver), workers.part(0.0, _AT_RECORDS))
    short = records.edge <= _SHORT * radius
    taken = weights.supported & (weights.apply_squares(~short) == 0)
    slope = None if found.slope is None else weights.apply(found.slope, np.float32)
    lowest = min(float(found.irradiance.min(initial=0)), 0.0)  # not 0 where lamps take light away
    light = np.maximum(weights.apply(found.irradiance, np.float32), np.float32(lowest))
    estimates = Estimate(light, weights.mean(found.stderr).astype(np.float32), slope)
    others = np.flatnonzero(~taken)
    estimates.put(others, density.at(receivers.where(others), workers.part(_AT_RECORDS, 1.0))[0])
    return estimates
