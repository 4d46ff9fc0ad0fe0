"""Direct light, kept estimate by estimate, so that an edit leaves what it does not change as well known as it was.

The k-th estimate of a row (a vertex, or a side of an element) takes the same random numbers whenever it is made. After
an edit they are made again one after the other. While those made again are what they were, the row's light is the mean
of all that it has; once one differs, the edit touched the row, and its light is the mean of those made again.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ....core.compiling import by_reference, part
from ....core.vec3 import ONE, ZERO, put, row

_SAME = np.float32(1e-4)  # relative difference of an estimate that is what it was
_TINY = np.float32(1e-30)


@by_reference
class EstimateArrays(NamedTuple):
    """`Estimates` as kernels take them; see there."""

    value: np.ndarray
    weight: np.ndarray
    known: np.ndarray
    fresh: np.ndarray
    known_sum: np.ndarray
    fresh_sum: np.ndarray
    touched: np.ndarray
    mean: np.ndarray


@dataclass
class Estimates:
    """Up to n estimates of the direct light of each of r rows.

    Attributes
    ----------
    arrays : EstimateArrays
        value : (r, n, 3) float32, W/(m² sr), each estimate of E/π; weight : (r, n) or (r, 0) float32, of the estimates;
        known : (r,) int32, how many count; fresh : (r,) int32, how many were made since the last edit; known_sum :
        (r, 4) float32, of those that count, with the sum of weights; fresh_sum : (r, 4) float32, of those made since;
        touched : (r,) bool, whether one of these differs from what it was; mean : (r, 3) float32, the light.
    n_fresh : int
        How many of each row were made since the last edit.
    """

    arrays: EstimateArrays
    n_fresh: int = 0

    @staticmethod
    def none(n_rows: int, n: int, weighted: bool) -> "Estimates":
        """Room for estimates, of which there is none yet."""
        f = np.float32
        value, weight = np.zeros((n_rows, n, 3), f), np.ones((n_rows, n if weighted else 0), f)
        known, fresh = np.zeros((2, n_rows), np.int32)
        sums = np.zeros((n_rows, 4), f), np.zeros((n_rows, 4), f)
        touched, mean = np.ones(n_rows, np.bool_), np.zeros((n_rows, 3), f)
        return Estimates(EstimateArrays(value, weight, known, fresh, *sums, touched, mean))

    @property
    def n_most(self) -> int:
        return self.arrays.value.shape[1]

    @property
    def finished(self) -> bool:
        """Whether all were made since the last edit."""
        return self.n_fresh >= self.n_most

    @property
    def mean(self) -> np.ndarray:
        """The light, (r, 3) float32."""
        return self.arrays.mean

    @property
    def coverage(self) -> np.ndarray:
        """Mean weight of the estimates, (r,) float32; 1 where there is none."""
        known = self.arrays.known
        return np.where(known > 0, self.arrays.known_sum[:, 3] / np.maximum(known, 1), 1).astype(np.float32)

    def made_to(self, last: int) -> None:
        """Say how many of each row were made since the last edit."""
        self.n_fresh = last

    def again(self) -> None:
        """After an edit: all are to be made again."""
        self.arrays.touched[:] = False
        self.arrays.fresh[:], self.arrays.fresh_sum[:] = 0, 0
        self.n_fresh = 0


@part
def put_estimate(of, i, k, light, weight):
    """Take the k-th estimate of row i, made again after those before it; one made since the edit counts once."""
    if k < of.fresh[i]:
        return
    of.fresh[i] = k + 1
    was = row(of.value[i], k)
    if k < of.known[i] and not of.touched[i]:
        changed = abs(light[0] - was[0]) + abs(light[1] - was[1]) + abs(light[2] - was[2])
        of.touched[i] = changed > _SAME * (abs(was[0]) + abs(was[1]) + abs(was[2])) + _TINY
    put(of.value[i], k, light)
    of.fresh_sum[i, 0] += weight * light[0]
    of.fresh_sum[i, 1] += weight * light[1]
    of.fresh_sum[i, 2] += weight * light[2]
    of.fresh_sum[i, 3] += weight
    if of.touched[i] or k >= of.known[i]:
        of.known[i] = k + 1
        for c in range(4):
            of.known_sum[i, c] = of.fresh_sum[i, c]
    if of.known_sum[i, 3] > ZERO:
        share = ONE / of.known_sum[i, 3]
        for c in range(3):
            of.mean[i, c] = of.known_sum[i, c] * share
