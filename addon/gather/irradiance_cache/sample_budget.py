"""How much is gathered, and where the next rays go."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

_NOISE_OF_RAY = 0.66  # of what comes from all sides: the standard deviation of L, over its mean, in a lit room
_BISECTIONS = 60
NEVER_SPARED = 24_000
"""Records that always send as many rays as they should: a draft's take few seconds."""


@dataclass(frozen=True)
class SampleBudget:
    """When a final gather is done.

    Attributes
    ----------
    n_rays : int
        Rays that a record sends on the average, half of them to whose noise the error is most sensitive.
    noise : float
        If not 0: rays are added until the root mean square of the standard errors is this share of the mean.
    deadline : float, s
        If finite: rays are added until then, by `time.perf_counter`.
    interpolate : bool
        False: every receiver is a record.
    share : float
        Of the receivers, or `NEVER_SPARED` if that is more: so many may be records before rays are short; 1: all.
    besides : tuple of float, W/m²
        Of each light: standard error that more rays do not lessen, and that counts for `noise` too.
    """

    n_rays: int
    noise: float = 0.0
    deadline: float = np.inf
    interpolate: bool = True
    share: float = 1.0
    besides: tuple[float, ...] = (0.0,)

    @property
    def tolerance(self) -> float:
        """Share of the irradiance that interpolation may be off: about the noise that the rays leave."""
        of_rays = _NOISE_OF_RAY / self.n_rays**0.5
        return min(of_rays, self.noise) if self.noise else of_rays

    def most_rays(self, n_receivers: int) -> float:
        """Rays that all records of so many receivers should send together."""
        if self.share == 1 or not self.interpolate:
            return np.inf
        return self.n_rays * max(NEVER_SPARED, self.share * n_receivers)

    def variance_for(self, mean: float) -> float:
        """Mean variance that rays may leave in light of that mean: a quarter of it, however large the other error."""
        asked = (self.noise * mean) ** 2
        return max(asked - self.besides[0] ** 2, asked / 4)

    def of_light(self, i: int) -> "SampleBudget":
        """The budget for one of several lights."""
        return self if len(self.besides) == 1 else replace(self, besides=self.besides[i : i + 1])

    @property
    def seconds_left(self) -> float:
        return self.deadline - perf_counter()


def rays_for_noise(per_ray: np.ndarray, sensitivity: np.ndarray, n_rays: np.ndarray, variance: float) -> np.ndarray:
    """Rays (m,) float64, at least `n_rays`, with which Σ sensitivity · per_ray / rays is `variance` at the least cost.

    Parameters
    ----------
    per_ray : (m,)
        Variance of one ray of each record.
    sensitivity : (m,)
        Error sensitivity: what the variance of each record's mean counts for, in all receivers together.
    """
    return _wanted(
        per_ray, sensitivity, n_rays, lambda wanted: float((sensitivity * per_ray / wanted).sum()) <= variance
    )


def rays_for_budget(per_ray: np.ndarray, sensitivity: np.ndarray, n_rays: np.ndarray, budget: float) -> np.ndarray:
    """Rays (m,) float64, at least `n_rays`, with which Σ sensitivity · per_ray / rays is least for a budget more."""
    return _wanted(per_ray, sensitivity, n_rays, lambda wanted: float((wanted - n_rays).sum()) >= budget)


def _wanted(
    per_ray: np.ndarray, sensitivity: np.ndarray, n_rays: np.ndarray, enough: Callable[[np.ndarray], bool]
) -> np.ndarray:
    """max(n_rays, λ √(sensitivity · per_ray)), the best for a sum of rays (Neyman), with the least λ that is enough."""
    ideal = np.sqrt(sensitivity * per_ray)
    low, high = -60.0, 60.0  # of log₂(λ / least useful λ)
    useful = ideal > 0
    if not useful.any():
        return n_rays.astype(np.float64)
    least = float((n_rays[useful] / ideal[useful]).min())
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        if enough(np.maximum(n_rays, least * 2.0**middle * ideal)):
            high = middle
        else:
            low = middle
    return np.maximum(n_rays, least * 2.0**high * ideal)
