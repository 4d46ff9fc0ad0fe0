"""What is known of the records' errors, and what those around a record are worth to it."""

from dataclasses import dataclass

import numpy as np

from .records import Records
from .weights import Weights


@dataclass(frozen=True)
class Spread:
    """How far m records may be off, of the irradiance's mean over colours.

    A record and what those around it say are two estimates of the same light, with independent noise of variances v and
    v'; the second is also off by what light changes in between. Their squared difference is d² = v + v' + b² on the
    average, and the best combination of the two is the record moved by v / d² of the way to the others.

    Attributes
    ----------
    per_ray : (m,) float64, (W/m²)²
        Variance of what one ray tells.
    expected : (m,) float64, (W/m²)²
        The same from other records alone, by which rays are shared out: where a record's own rays decided whether it
        gets more of them, those that missed a rare bright thing would get none, and all together would be too dark.
    others : (m,) float64, (W/m²)²
        v'; 0 where there are no others.
    bias2 : (m,) float64, (W/m²)²
        b².
    blend : (m,) float64
        v / d²; 0 where there are no others. With `fair`, v is `expected` for the same reason.
    """

    per_ray: np.ndarray
    expected: np.ndarray
    others: np.ndarray
    bias2: np.ndarray
    blend: np.ndarray

    @staticmethod
    def of(records: Records, around: Weights | None, fair: bool = False) -> "Spread":
        """Of each record and of those `around` it in equal parts: few batches of rays tell little of their variance.

        Parameters
        ----------
        around : Weights or None
            What each record takes from others; None: nobody takes anything from others.
        fair : bool
            For records of so few rays that their own say little of their variance.
        """
        per_ray = records.variance * records.n_rays
        nothing, all_alike = np.zeros(len(records)), np.full(len(records), per_ray.mean() if len(records) else 0.0)
        if around is None:
            return Spread(per_ray, all_alike, nothing, nothing, nothing)
        supported, mean = around.supported, around.mean()
        expected = np.where(supported, mean.apply(per_ray), all_alike)
        per_ray = np.where(supported, (per_ray + mean.apply(per_ray)) / 2, per_ray)
        noise = per_ray / records.n_rays
        others = around.square().apply(noise)
        value = records.irradiance.mean(axis=1)
        off2 = np.where(supported, (around.apply(value) - value) ** 2, 0)
        off2 = np.where(supported, (off2 + mean.apply(off2)) / 2, 0)
        own = expected / records.n_rays if fair else noise
        blend = np.where(supported, own / np.maximum(np.maximum(off2, own + others), 1e-30), 0)
        return Spread(per_ray, expected, others, np.maximum(off2 - noise - others, 0), blend)

    def blended(self, value: np.ndarray, around: Weights | None) -> np.ndarray:
        """Values of the records, (m, 3), moved to what those around them say, (m, 3) float64."""
        return value if around is None else value + self.blend[:, None] * (around.apply(value) - value)

    def variance(self, records: Records, weights: Weights) -> np.ndarray:
        """Squared standard error of what receivers take from blended records, (n,).

        The records' own noise is independent. What they took from others is about the same for all that a receiver
        looks at. Where light changes, a receiver is off by what a record is off without the weight that it has itself.
        """
        own = weights.square().apply((1 - self.blend) ** 2 * self.per_ray / records.n_rays)
        taken = weights.apply(self.blend * np.sqrt(self.others)) ** 2
        foreign = np.maximum(1 - weights.own(records.receiver), self.blend)
        return own + taken + weights.mean().apply(foreign**2 * self.bias2)
