"""What is known of the records' errors, what those around a record say of it, and what receivers' errors are by it."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core.compiling import kernel, kernel_array, part
from ...core.parallel import slices
from ...core.vec3 import BLACK, ZERO, dot, minus, plus, row, times
from ...core.z_curve import CURVE_BITS, z_curve
from .records import Records
from .weights import Weights

_MOST_BEYOND = np.float64(4)
"""Times what those around records tell, squared: light is not known farther beyond them. It holds for few receivers, at
borders of faces and behind contacts. Around a column on a floor, with an error of 4.8 % of the light, 4 says 5.9 %; 16
says 6.6 %, and no bound 6.9 %, without any more error; 1 has more, in proportion to what it says."""

_LEVELS = range(2, 5)
"""Cells that tell what is rarely met: of 1/4 to 1/16 of the records' extent."""

_PRIOR = 16.0  # records, for which what is known of the larger cell around it counts in a cell
_NEAREST, _SURROUNDINGS = 13.0, 2.0
"""Records that a variance is told by, itself and those around it, and for how many the cells around them count."""

_TINY = np.float64(1e-30)
_CHUNK = 1 << 17


@dataclass(frozen=True)
class Around:
    """What each of m records takes from others, and how far away these are.

    Attributes
    ----------
    weights : Weights
    distance2 : (m,) float64, m²
        Mean of t² over the others with positive weights, t being the way to one.
    curve2 : (m,) float64, m⁴
        (Σ |w| t²)²: what the others are off by, squared and up to a factor, in light that bends.
    blends : bool
        Whether records take anything from others; else these tell the variance alone.
    fair : bool
        Whether a record's own variance has no say in how far it moves to others: with few rays, those that missed
        what is bright would be believed, and the mean be too dark.
    """

    weights: Weights
    distance2: np.ndarray
    curve2: np.ndarray
    blends: bool = True
    fair: bool = False

    @staticmethod
    def of(weights: Weights, records: Records, blends: bool = True, fair: bool = False) -> "Around":
        """Of records, by what they take from each other."""
        distance2, curve2 = np.zeros((2, len(records)))
        _all_ways(weights, kernel_array(records.position, np.float32), distance2, curve2)
        return Around(weights, distance2, curve2, blends, fair)


class _Columns(NamedTuple):
    """Of m records, what the error of a receiver is made of, float64 each: (m,) but for `position` (m, 3) float32."""

    position: np.ndarray
    noise: np.ndarray
    taken: np.ndarray
    taken_bias2: np.ndarray
    change2: np.ndarray
    bias2: np.ndarray
    distance2: np.ndarray
    curve2: np.ndarray


@dataclass(frozen=True)
class RecordErrorModel:
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
    chance2 : (m,) float64, (W/m²)²
        What blended records are off by besides, as the blend hangs on chance: see `_by_chance`.
    change2 : (m,) float64, (W/m²)²
        Mean squared difference to the single others, without that of their noise.
    around : Around
    """

    per_ray: np.ndarray
    expected: np.ndarray
    others: np.ndarray
    bias2: np.ndarray
    blend: np.ndarray
    chance2: np.ndarray
    change2: np.ndarray
    around: Around

    @staticmethod
    def of(records: Records, around: Around) -> "RecordErrorModel":
        """Of each record and of those around it in equal parts: few batches of rays tell little of their variance."""
        weights, per_ray = around.weights, records.variance * records.n_rays
        all_alike = np.full(len(records), per_ray.mean() if len(records) else 0.0)
        supported, of_others = weights.supported, weights.mean(per_ray)
        expected = np.where(supported, of_others, all_alike)
        per_ray = np.where(supported, (per_ray + of_others) / 2, per_ray)
        if not around.blends:
            nothing = np.zeros(len(records))
            return RecordErrorModel(per_ray, expected, *5 * (nothing,), around)
        noise = per_ray / records.n_rays
        others = weights.apply_squares(noise)
        value = records.irradiance.mean(axis=1)
        single2 = np.where(supported, (weights.apply(value) - value) ** 2, 0)
        off2 = np.where(supported, (single2 + weights.mean(single2)) / 2, 0)
        own = expected / records.n_rays if around.fair else noise
        blend = np.where(supported, own / np.maximum(np.maximum(off2, own + others), _TINY), 0)
        bias2 = np.maximum(off2 - noise - others, 0)
        fixed2 = (1 - blend) ** 2 * noise + blend**2 * (others + bias2)
        variances = records.variance, expected / records.n_rays
        chance = _by_chance(*variances, blend, single2, np.where(off2 > own + others, off2, np.inf), fixed2)
        chance2 = np.maximum(weights.mean(chance), 0)
        mean = weights.mean(np.stack([value, value**2, noise], axis=1))
        change2 = mean[:, 1] - 2 * value * mean[:, 0] + value**2 - mean[:, 2] - noise
        change2 = np.where(supported, change2, 0)
        return RecordErrorModel(per_ray, expected, others, bias2, blend, chance2, change2, around)

    def blended(self, value: np.ndarray) -> np.ndarray:
        """Values of the records, (m, 3), moved to what those around them say, (m, 3) float64."""
        if not self.around.blends:
            return value
        return value + self.blend[:, None] * (self.around.weights.apply(value) - value)

    def bias2_of(self, records: Records, weights: Weights, position: np.ndarray) -> np.ndarray:
        """Squared error of what points (n, 3) take, for all that the light changes between the records, (n,) float32.

        Light that changes in straight lines is off by its slope times what the weights leave of the ways to the
        records; light that bends, by as much as the records are from what those around them say, and the more the
        farther the records are.
        """
        return self._errors(records, weights, position)[0]

    def variance(self, records: Records, weights: Weights, position: np.ndarray) -> np.ndarray:
        """Squared standard error of what points (n, 3) take from blended records, (n,) float32.

        The records' own noise is independent, and so is what chance makes of their blends. What they took from others
        is about the same for all that a receiver looks at, and off by what light changes.
        """
        return self._errors(records, weights, position)[1]

    def _widened(self, records: Records) -> np.ndarray:
        """`per_ray`, (m,), with what rays met elsewhere in the surroundings.

        Something bright that hardly any ray meets is missed by all rays of most records and of those next to them.
        Their error is what it would have brought, though they agree; records farther away that did meet it say so.
        """
        far = mean_of_cells(records.position, records.variance * records.n_rays)
        return (_NEAREST * self.per_ray + _SURROUNDINGS * far) / (_NEAREST + _SURROUNDINGS)

    def _errors(self, records: Records, weights: Weights, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        columns = _Columns(
            kernel_array(records.position, np.float32),
            (1 - self.blend) ** 2 * self._widened(records) / records.n_rays + self.chance2,
            self.blend * np.sqrt(self.others),
            self.blend**2 * self.bias2,
            self.change2,
            self.bias2,
            self.around.distance2,
            self.around.curve2,
        )
        bias2, variance = np.empty((2, len(position)), np.float32)
        position = kernel_array(position, np.float32)
        for chunk in slices(len(position), _CHUNK):
            _all_errors(columns, weights, position, chunk.start, bias2[chunk], variance[chunk])
        return bias2, variance


def _by_chance(
    own: np.ndarray, of_others: np.ndarray, blend: np.ndarray, single2: np.ndarray, off2: np.ndarray, fixed2: np.ndarray
) -> np.ndarray:
    """What the squared errors of blended records have besides those of fixed blends, (m,); single ones may be negative.

    The blend β is the smaller, the farther a record's own noise takes it from the others: that noise is left where it
    is large. By Stein ("Estimation of the Mean of a Multivariate Normal Distribution", 1981) a value of normal noise of
    variance v that is moved by g(D), D being what the others have more, has a squared error of v + g² − 2 v g′ on the
    average, whatever light is. Here g = β D, and β = v / d² has the slope −β D / d², as half of d² is D². The v of the
    formula is what others tell: β is large where a record's own rays tell too large a v, and their product would be
    larger than v times the mean of β.

    Noise that is not normal moves v as well as D: a record that met what is rare has both, and its blend is as before.
    There a record and those around it tell different variances. So the formula counts by how far these agree: by their
    geometric over their arithmetic mean, which is 0.9 for four batches of normal noise.

    Parameters
    ----------
    own, of_others : (m,)
        v as a record itself and those around it tell it.
    single2 : (m,)
        D² of the record alone.
    off2 : (m,)
        d², of which half is D²; infinite where the blend does not follow it.
    fixed2 : (m,)
        The squared error of a fixed blend.
    """
    stein2 = of_others * (1 - 2 * blend * (1 - single2 / np.maximum(off2, _TINY))) + blend**2 * single2
    alike = np.sqrt(own * of_others) / np.maximum((own + of_others) / 2, _TINY)
    return alike * (stein2 - fixed2)


def mean_of_cells(position: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Means of values (m,) around positions (m, 3), from all to those of ever smaller cells, as many as these have."""
    code, mean = z_curve(position), np.full(len(values), values.mean() if len(values) else 0.0)
    for level in _LEVELS:
        _, cell = np.unique(code >> np.uint64(3 * (CURVE_BITS - level)), return_inverse=True)
        sums, counts = np.bincount(cell, values)[cell], np.bincount(cell)[cell]
        mean = (sums + _PRIOR * mean) / (counts + _PRIOR)
    return mean


@kernel
def _all_errors(columns, weights, position, first, bias2, variance):
    for i in range(len(bias2)):
        bias2[i], variance[i] = _error_at(columns, weights, first + i, row(position, first + i))


@part
def _error_at(columns, weights, i, at):
    """What `RecordErrorModel.bias2_of` and `variance` say of a point, the i-th of the weights'."""
    slope2, curve2, _ = _ways(weights, i, at, columns.position)
    noise = taken = taken_bias2 = total = np.float64(0)
    change2 = bias2 = usual_distance2 = usual_curve2 = np.float64(0)
    for j in range(weights.start[i], weights.start[i + 1]):
        record, weight = weights.record[j], np.float64(weights.weight[j])
        positive = max(weight, np.float64(0))
        total += positive
        noise += weight * weight * columns.noise[record]
        taken += weight * columns.taken[record]
        taken_bias2 += positive * columns.taken_bias2[record]
        change2 += positive * columns.change2[record]
        bias2 += positive * columns.bias2[record]
        usual_distance2 += positive * columns.distance2[record]
        usual_curve2 += positive * columns.curve2[record]
    share = np.float64(1) / max(total, _TINY)
    sloped = min(slope2 / max(usual_distance2 * share, _TINY), _MOST_BEYOND)  # over all ways across and along
    bent = min(curve2 / max(usual_curve2 * share, _TINY), _MOST_BEYOND)
    off2 = max(change2 * share, np.float64(0)) * sloped + bias2 * share * bent
    return off2, noise + taken * taken + taken_bias2 * share + off2


@kernel
def _all_ways(weights, position, distance2, curve2):
    for i in range(len(position)):
        _, curve2[i], distance2[i] = _ways(weights, i, row(position, i), position)


@part
def _ways(weights, i, at, position):
    """How far from the i-th point, which is at `at`, the records lie that it looks at: by the ways t to them,

    |Σ w t|², what the look-up is off by, squared, in light of slope 1 along it; (Σ |w| t²)², the same up to a factor in
    light that bends; and the mean of t² over the records with positive weights.
    """
    mean, curve, distance2, total = BLACK, np.float64(0), np.float64(0), np.float64(0)
    for j in range(weights.start[i], weights.start[i + 1]):
        way, weight = minus(row(position, weights.record[j]), at), weights.weight[j]
        square = np.float64(dot(way, way))
        mean = plus(mean, times(way, weight))
        curve += abs(weight) * square
        distance2 += max(weight, ZERO) * square
        total += max(weight, ZERO)
    return np.float64(dot(mean, mean)), curve * curve, distance2 / max(total, _TINY)
