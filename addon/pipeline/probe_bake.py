"""The light of probes, from a solve of the light in the scene."""

import numpy as np

from ..core.parallel import Workers
from ..gather import LEAST_ESTIMATES, ProbeLight, caustics_at_probes, gather_probes
from .solution import Solution

_OF_RAYS = 0.9  # of the stage


def probe_light(solution: Solution, positions: np.ndarray, n_rays: int, workers: Workers) -> ProbeLight:
    """Light at positions (n, 3) in the air; direct light with it where the solution's settings ask for it.

    Parameters
    ----------
    n_rays : int
        Of each probe.
    """
    settings, rays = solution.settings, solution.rays
    assert rays is not None  # as the settings were found to need a cache
    direct = solution.direct if settings.add_direct else None
    at = positions, n_rays, workers.part(0.0, _OF_RAYS)
    light = gather_probes(rays, direct, *at).with_noise(solution.noise)
    n_nearest = settings.n_nearest
    flights = solution.mid_air.log.flights() if solution.mid_air else None
    if flights is not None:
        flights = flights.where(flights.specular)
        if len(flights) >= LEAST_ESTIMATES * n_nearest:
            light = light.plus(caustics_at_probes(flights, positions, n_nearest, workers.part(_OF_RAYS, 1.0)))
    return light
