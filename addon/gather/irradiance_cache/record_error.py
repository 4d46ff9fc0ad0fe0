"""What is known of the records' errors, and what those around a record are worth to it."""

from dataclasses import dataclass

import numpy as np

from ...core.parallel import slices
from ...core.sampling.vectors import rows
from .records import Records
from .weights import Weights

_MOST_BEYOND = 4.0
"""Times what those around records tell, squared: light is not known farther beyond them. It holds for few receivers, at
borders of faces and behind contacts. Around a column on a floor, with an error of 4.8 % of the light, 4 says 5.9 %; 16
says 6.6 %, and no bound 6.9 %, without any more error; 1 has more, in proportion to what it says."""

_CHUNK = 1 << 15


@dataclass(frozen=True)
class Arms:
    """How far from each of n points the records lie that it looks at.

    Attributes
    ----------
    slope2 : (n,) float32, m²
        |Σ w t|² of the ways t to them: what the look-up is off by, squared, in light of slope 1 along it.
    curve2 : (n,) float32, m⁴
        (Σ |w| t²)²: the same, up to a factor, in light that bends.
    distance2 : (n,) float32, m²
        Mean of t² over the records with positive weights.
    """

    slope2: np.ndarray
    curve2: np.ndarray
    distance2: np.ndarray

    @staticmethod
    def of(weights: Weights, position: np.ndarray, records: Records) -> "Arms":
        """Of points at positions (n, 3)."""
        slope2, curve2, distance2 = (np.zeros(len(position), np.float32) for _ in range(3))
        positive = weights.mean().weight
        for part in slices(len(position), _CHUNK):
            way = rows(records.position, weights.record[part]) - position[part, None]
            w, square = weights.weight[part], np.einsum("nki,nki->nk", way, way)
            mean = np.einsum("nk,nki->ni", w, way)
            slope2[part] = np.einsum("ni,ni->n", mean, mean)
            curve2[part] = np.einsum("nk,nk->n", np.abs(w), square) ** 2
            distance2[part] = np.einsum("nk,nk->n", positive[part], square)
        return Arms(slope2, curve2, distance2)


@dataclass(frozen=True)
class Around:
    """What each record takes from others, and how far away these are.

    Attributes
    ----------
    weights : Weights
    arms : Arms
    blends : bool
        Whether records take anything from others; else these tell the variance alone.
    fair : bool
        Whether a record's own variance has no say in how far it moves to others: with few rays, those that missed
        what is bright would be believed, and the mean be too dark.
    """

    weights: Weights
    arms: Arms
    blends: bool = True
    fair: bool = False


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
        v / d²; 0 where there are no others. With `Around.fair`, v is `expected` for the same reason.
    change2 : (m,) float64, (W/m²)²
        Mean squared difference to the single others, without that of their noise.
    around : Around
    """

    per_ray: np.ndarray
    expected: np.ndarray
    others: np.ndarray
    bias2: np.ndarray
    blend: np.ndarray
    change2: np.ndarray
    around: Around

    @staticmethod
    def of(records: Records, around: Around) -> "Spread":
        """Of each record and of those around it in equal parts: few batches of rays tell little of their variance."""
        weights, per_ray = around.weights, records.variance * records.n_rays
        all_alike = np.full(len(records), per_ray.mean() if len(records) else 0.0)
        supported, mean = weights.supported, weights.mean()
        expected = np.where(supported, mean.apply(per_ray), all_alike)
        per_ray = np.where(supported, (per_ray + mean.apply(per_ray)) / 2, per_ray)
        if not around.blends:
            nothing = np.zeros(len(records))
            return Spread(per_ray, expected, nothing, nothing, nothing, nothing, around)
        noise = per_ray / records.n_rays
        others = weights.square().apply(noise)
        value = records.irradiance.mean(axis=1)
        off2 = np.where(supported, (weights.apply(value) - value) ** 2, 0)
        off2 = np.where(supported, (off2 + mean.apply(off2)) / 2, 0)
        own = expected / records.n_rays if around.fair else noise
        blend = np.where(supported, own / np.maximum(np.maximum(off2, own + others), 1e-30), 0)
        bias2 = np.maximum(off2 - noise - others, 0)
        of_others = mean.apply(np.stack([value, value**2, noise], axis=1))
        change2 = of_others[:, 1] - 2 * value * of_others[:, 0] + value**2 - of_others[:, 2] - noise
        return Spread(per_ray, expected, others, bias2, blend, np.where(supported, change2, 0), around)

    def blended(self, value: np.ndarray) -> np.ndarray:
        """Values of the records, (m, 3), moved to what those around them say, (m, 3) float64."""
        if not self.around.blends:
            return value
        return value + self.blend[:, None] * (self.around.weights.apply(value) - value)

    def bias2_of(self, weights: Weights, arms: Arms) -> np.ndarray:
        """Squared error of what points take, for all that the light changes between the records, (n,) float64.

        Light that changes in straight lines is off by its slope times what the weights leave of the ways to the
        records; light that bends, by as much as the records are from what those around them say, and the more the
        farther the records are.
        """
        columns = (self.change2, self.bias2, self.around.arms.distance2, self.around.arms.curve2)
        change2, bias2, distance2, curve2 = weights.mean().apply(np.stack(columns, axis=1)).T
        sloped = np.minimum(arms.slope2 / np.maximum(distance2, 1e-30), _MOST_BEYOND)  # over all ways across and along
        bent = np.minimum(arms.curve2 / np.maximum(curve2, 1e-30), _MOST_BEYOND)
        return np.maximum(change2, 0) * sloped + bias2 * bent

    def variance(self, records: Records, weights: Weights, arms: Arms) -> np.ndarray:
        """Squared standard error of what receivers take from blended records, (n,).

        The records' own noise is independent. What they took from others is about the same for all that a receiver
        looks at, and off by what light changes.
        """
        own = weights.square().apply((1 - self.blend) ** 2 * self.per_ray / records.n_rays)
        taken = weights.apply(self.blend * np.sqrt(self.others)) ** 2
        return own + taken + weights.mean().apply(self.blend**2 * self.bias2) + self.bias2_of(weights, arms)
