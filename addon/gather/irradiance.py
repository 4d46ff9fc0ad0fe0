"""The light that arrives at receivers."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Irradiance:
    """What n receivers receive.

    Attributes
    ----------
    value : (n, 3) float32, W/m²
        Sum of the passes.
    stderr : (n,) float32, W/m²
        Estimated standard error of the indirect light's mean over colours; the radiance cache's own noise is not in it.
    passes : dict of str to (n, 3) float32, W/m²
        ``indirect`` and, where asked for, ``direct``.
    counts : dict of str to int
        What the bake did, for its report: photons, rays, elements.
    """

    value: np.ndarray
    stderr: np.ndarray
    passes: dict[str, np.ndarray]
    counts: dict[str, int]

    @property
    def relative_noise(self) -> float:
        """Root mean square of the standard errors over the mean indirect irradiance; 0 where all is dark."""
        indirect = self.passes["indirect"]
        mean = float(indirect.mean(dtype=np.float64)) if indirect.size else 0.0
        return float(np.sqrt(np.mean(self.stderr.astype(np.float64) ** 2))) / mean if mean > 0 else 0.0
