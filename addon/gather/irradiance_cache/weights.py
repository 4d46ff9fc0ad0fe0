"""How much each record counts at each receiver, as compressed rows, and what sums with these weights say."""

from typing import NamedTuple

import numpy as np

from ...core.compiling import kernel, part
from ...core.parallel import slices

_PLAIN, _SQUARED, _POSITIVE = 0, 1, 2
_CHUNK = 1 << 17


class Weights(NamedTuple):
    """What each of n points takes from records: a sparse matrix of compressed rows.

    Attributes
    ----------
    start : (n + 1,) int32
        Where each point's entries begin; a point that has no record to look at has none.
    record : (z,) int32
    weight : (z,) float32
        Those of a point sum to one and may be negative; none is 0.
    """

    start: np.ndarray
    record: np.ndarray
    weight: np.ndarray

    @staticmethod
    def none(n: int) -> "Weights":
        """Of n points that take nothing."""
        return Weights(np.zeros(n + 1, np.int32), np.zeros(0, np.int32), np.zeros(0, np.float32))

    @staticmethod
    def identity(receiver: np.ndarray) -> "Weights":
        """Of points that each are a record, which holds that of the point `receiver` (m,)."""
        return Weights.of_one(np.argsort(receiver))

    @staticmethod
    def of_one(record: np.ndarray) -> "Weights":
        """Of points that take one record (n,) each."""
        n = len(record)
        return Weights(np.arange(n + 1, dtype=np.int32), record.astype(np.int32), np.ones(n, np.float32))

    @staticmethod
    def joined(parts: "list[Weights]") -> "Weights":
        """Those of the points of several parts, one after the other."""
        counts = np.concatenate([np.zeros(1, np.int32), *(np.diff(one.start) for one in parts)])
        record, weight = (np.concatenate(arrays) for arrays in zip(*(one[1:] for one in parts), strict=True))
        return Weights(np.cumsum(counts, dtype=np.int32), record, weight)

    @property
    def n_points(self) -> int:
        return len(self.start) - 1

    @property
    def supported(self) -> np.ndarray:
        """Which points have records to look at, (n,) bool."""
        return np.diff(self.start) > 0

    def apply(self, values: np.ndarray, dtype: type = np.float64) -> np.ndarray:
        """Weighted sums of the records' values (m, …), (n, …)."""
        return self._sums(_PLAIN, values, dtype)

    def apply_squares(self, values: np.ndarray) -> np.ndarray:
        """Sums with squared weights, as variances are summed, (n, …) float64."""
        return self._sums(_SQUARED, values, np.float64)

    def mean(self, values: np.ndarray) -> np.ndarray:
        """Means without the negative weights, of what must stay positive, (n, …) float64; 0 without records."""
        return self._sums(_POSITIVE, values, np.float64)

    def _sums(self, kind: int, values: np.ndarray, dtype: type) -> np.ndarray:
        columns = np.ascontiguousarray(values.reshape(len(values), -1), np.float64)
        sums: np.ndarray = np.empty((self.n_points, columns.shape[1]), dtype)
        for chunk in slices(self.n_points, _CHUNK):
            found = np.empty((chunk.stop - chunk.start, columns.shape[1]))
            _sum_rows(self, chunk.start, kind, columns, found)
            sums[chunk] = found
        return sums.reshape(-1, *values.shape[1:])

    def sums_of_squares(self, n_records: int) -> np.ndarray:
        """Sum over the points of the squares of what they take from each record, (m,) float64."""
        sums = np.zeros(n_records)
        _add_squares(self.record, self.weight, sums)
        return sums

    def replaced(
        self, points: np.ndarray, new: "Weights", first_record: int = 0, only: np.ndarray | slice = slice(None)
    ) -> "Weights":
        """The same, some points (k,) having new weights, of records that are numbered from `first_record` on.

        Of these points `only` some, if a mask (k,) says so.
        """
        row, points = np.full(self.n_points, -1, np.int32), points[only]
        row[points] = np.arange(new.n_points)[only]
        counts = np.diff(self.start)
        counts[points] = np.diff(new.start)[only]
        start = np.concatenate([np.zeros(1, np.int32), np.cumsum(counts, dtype=np.int32)])
        result = Weights(start, np.empty(start[-1], np.int32), np.empty(start[-1], np.float32))
        _splice(self, new, row, np.int32(first_record), result)
        return result


@part
def _counted(weight, kind):
    """What a weight counts for."""
    if kind == _SQUARED:
        return weight * weight
    if kind == _POSITIVE:
        return max(weight, np.float32(0))
    return weight


@kernel
def _sum_rows(weights, first, kind, values, sums):
    for i in range(len(sums)):
        begin, end, total = weights.start[first + i], weights.start[first + i + 1], np.float64(0)
        for c in range(values.shape[1]):
            sums[i, c] = 0.0
        for j in range(begin, end):
            weight, record = np.float64(_counted(weights.weight[j], kind)), weights.record[j]
            total += weight
            for c in range(values.shape[1]):
                sums[i, c] += weight * values[record, c]
        if kind == _POSITIVE and total > 0.0:
            for c in range(values.shape[1]):
                sums[i, c] /= total


@kernel
def _add_squares(record, weight, sums):
    for j in range(len(record)):
        sums[record[j]] += np.float64(weight[j]) ** 2


@kernel
def _splice(old, new, row, first_record, result):
    """Write each point's entries: those of its row of `new`, or where that is −1 its old ones."""
    for i in range(len(row)):
        k, at = row[i], result.start[i]
        kept = k < 0
        if kept:
            begin, end, moved = old.start[i], old.start[i + 1], np.int32(0)
        else:
            begin, end, moved = new.start[k], new.start[k + 1], first_record
        for j in range(begin, end):
            result.record[at] = (old.record[j] if kept else new.record[j]) + moved
            result.weight[at] = old.weight[j] if kept else new.weight[j]
            at += 1
