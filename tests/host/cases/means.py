"""Means of the light at the probes, and how two of them compare."""

from dataclasses import dataclass

import numpy as np

BOUND = 0.02
"""How far the means may lie apart besides their noise."""

NOISE = 0.015
"""Relative error in grey above which a comparison tells too little to count."""

CHANNELS = ("red", "green", "blue", "grey")


@dataclass(frozen=True)
class Mean:
    """E_indirect / π, the mean of the probes.

    Attributes
    ----------
    value, stderr : (4,) float64
        Mean and its standard error, in red, green, blue and grey, which is their mean.
    """

    value: np.ndarray
    stderr: np.ndarray

    @classmethod
    def of_colors(cls, value: np.ndarray, stderr: np.ndarray) -> "Mean":
        """A mean of three colours. Their errors go together where paths are white, and so does grey's with them."""
        return cls(np.append(value, np.mean(value)), np.append(stderr, np.mean(stderr)))

    @classmethod
    def of_runs(cls, runs: list[np.ndarray]) -> "Mean":
        """The mean of independent runs of three colours."""
        table = np.array(runs, np.float64)
        return cls.of_colors(table.mean(axis=0), table.std(axis=0, ddof=1) / len(table) ** 0.5)

    @property
    def relative_error(self) -> float:
        """In grey; 0 where all is dark."""
        return float(self.stderr[-1] / max(self.value[-1], 1e-30))

    def __str__(self) -> str:
        return f"{self.value[-1]:.4g} ± {self.relative_error:.1%}"


@dataclass(frozen=True)
class Comparison:
    """A bake beside its reference."""

    truth: Mean
    ours: Mean

    @property
    def difference(self) -> np.ndarray:
        """(4,), of the reference; 0 where both are dark."""
        return (self.ours.value - self.truth.value) / np.maximum(self.truth.value, 1e-30)

    @property
    def tolerance(self) -> np.ndarray:
        """(4,), of the reference: the bound and two standard errors of both."""
        noise = np.hypot(self.ours.stderr, self.truth.stderr)
        return BOUND + 2 * noise / np.maximum(self.truth.value, 1e-30)

    @property
    def worst(self) -> int:
        """The channel that comes closest to failing, or fails most."""
        return int(np.argmax(np.abs(self.difference) / self.tolerance))

    @property
    def is_clear(self) -> bool:
        """Whether both are known well enough to compare."""
        return max(self.ours.relative_error, self.truth.relative_error) <= NOISE

    @property
    def passes(self) -> bool:
        return self.is_clear and bool((np.abs(self.difference) <= self.tolerance).all())

    def __str__(self) -> str:
        at = self.worst
        told = "" if self.is_clear else f", too noisy to tell: {self.ours.relative_error:.1%}"
        return f"{self.difference[at]:+.1%} in {CHANNELS[at]}, tolerance {self.tolerance[at]:.1%}{told}"
