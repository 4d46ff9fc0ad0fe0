"""Noise out of gathered light, over surfaces: local polynomials as wide as light lets them be.

Receivers that gathered (records) have independent noise of a known size. Around each, parabolas are fitted to the light
of its nearest records (weighted least squares in its tangent plane), of few and of many. A fit of many has little
variance v, and a bias b where light is no parabola: its squared differences from the records' own light are
σ² (1 − 2l) + v + b² on the average, l being the record's weight in its own fit, so their mean over the
surroundings tells b². Fits and the record's own light, with a mean squared error of v + B b² and σ², are mixed by the
inverse squares of these errors; B > 1, as a mean dilutes what is wrong in one place. All other receivers take the fits
of the records nearest to them. None changes by more than `MOST` standard errors.

The neighbours are found by place and normal alike, whatever object they are on; what faces another way or lies above or
below the tangent plane does not count. Caustics, which are sharp, and direct light stay as they are.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...gather import Irradiance
from ...parallel import Workers, slices
from ...receivers import Receivers
from ...sampling.vectors import rows
from ...sampling.warps import frame

STAGE = "Denoising vertices"

N_NEIGHBOURS = (24, 64, 160)
"""Records that fits are made of."""

MOST = 2.5

_TURN = 0.25  # of the extent: a record as far away counts as near as one at the same place that is turned by 57°
_TILT = 0.5  # difference of unit normals at which a record counts no more
_HEIGHT = 0.25  # of the farthest record's distance, above or below the tangent plane, at which one counts no more
_RIDGE = np.array([1e-9, 0.02, 0.02, 0.05, 0.05, 0.05])  # of the weights: how far few records may be extrapolated
_CHANCE = np.array(
    [1.35, 1.25, 1.2], np.float32
)  # of the differences that noise makes: by as much they may be more by chance
_LOCAL = 8.0  # B
_AROUND, _TIMES = 24, (1, 2, 4)  # records that differences are averaged over, so many times for each fit
_NEAREST = 4  # records whose fits a receiver takes
_CHUNK = 2048


def denoised(
    light: Irradiance, receivers: Receivers, has_say: np.ndarray, extent: float, workers: Workers
) -> Irradiance:
    """Light of n receivers without most of its noise, where they gathered themselves or took it from those that did.

    Parameters
    ----------
    has_say : (n,) bool
        Of the receivers: the light of others is hidden, and counts for nobody else.
    extent : float, m
        Of most receivers.
    """
    if light.gathered is None:
        return light
    indirect = light.passes["indirect"]
    caustics = np.float32(0) if light.caustics is None else light.caustics
    smooth, k = indirect - caustics, np.flatnonzero(light.gathered & has_say)
    if len(k) < 2 * _NEAREST or not light.stderr.any():
        return light
    records = _Records(rows(receivers.position, k), rows(receivers.normal, k), smooth[k], light.stderr[k], extent)
    fits = _Fits.of(records, workers.part(0, 0.7))
    change, stderr = np.zeros_like(smooth), light.stderr.copy()
    those = np.flatnonzero(has_say)

    def take(chunk: slice) -> tuple[np.ndarray, np.ndarray]:
        at = those[chunk]
        return fits.at(rows(receivers.position, at), rows(receivers.normal, at), smooth[at], light.stderr[at])

    for chunk, (value, error) in _each(take, len(those), workers.part(0.7, 1)):
        change[those[chunk]], stderr[those[chunk]] = value - smooth[those[chunk]], error
    lowest = min(float(indirect.min()), 0.0)
    passes = {**light.passes, "indirect": np.maximum(indirect + change, lowest)}
    return replace(light, value=np.sum(list(passes.values()), axis=0, dtype=np.float32), stderr=stderr, passes=passes)


@dataclass(frozen=True)
class _Records:
    """m receivers that gathered: where they are, light (m, 3), and its standard error (m,)."""

    position: np.ndarray
    normal: np.ndarray
    light: np.ndarray
    stderr: np.ndarray
    extent: float

    def __len__(self) -> int:
        return len(self.position)

    @cached_property
    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        return frame(self.normal)

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self._place(self.position, self.normal))

    def _place(self, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
        return np.concatenate([position, np.float32(_TURN * self.extent) * normal], axis=1)

    def nearest(self, position: np.ndarray, normal: np.ndarray, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Distance and number of the k records nearest to points, (n, k) each."""
        distance, near = self._tree.query(self._place(position, normal), min(k, len(self)))
        return distance.reshape(len(position), -1).astype(np.float32), near.reshape(len(position), -1).astype(np.int32)

    def weights(self, way: np.ndarray, normal: np.ndarray, near: np.ndarray, reach: np.ndarray) -> np.ndarray:
        """How much records `near` (n, k) count at points that see them at `way` (n, k, 3), up to a reach (n,)."""
        distance2 = np.einsum("nki,nki->nk", way, way)
        height = np.einsum("nki,ni->nk", way, normal)
        tilt = rows(self.normal, near.ravel()).reshape(way.shape) - normal[:, None]
        reach = reach[:, None]
        weight = _bump(distance2 / reach**2) * _bump(np.einsum("nki,nki->nk", tilt, tilt) / np.float32(_TILT**2))
        return weight * _bump((height / (np.float32(_HEIGHT) * reach)) ** 2)


@dataclass(frozen=True)
class _Fits:
    """Parabolas around records.

    Attributes
    ----------
    coefficient : (m, 3 fits, 6, 3) float32
    reach : (m, 3) float32, m
        Unit of their arguments.
    share : (m, 3) float32
        Of each fit in the mixture; the rest is the record's own light.
    variance : (m,) float32
        Of the mixture's mean squared error.
    """

    records: _Records
    coefficient: np.ndarray
    reach: np.ndarray
    share: np.ndarray
    variance: np.ndarray

    @staticmethod
    def of(records: _Records, workers: Workers) -> "_Fits":
        """Fits to the records, and how much each is trusted."""
        n, n_fits = len(records), len(N_NEIGHBOURS)
        coefficient, reach = np.empty((n, n_fits, 6, 3), np.float32), np.empty((n, n_fits), np.float32)
        variance, expected = np.empty((2, n, n_fits), np.float32)
        around, weight = np.empty((n, min(_AROUND, n)), np.int32), np.empty((n, min(_AROUND, n)), np.float32)

        def fit(chunk: slice) -> tuple[np.ndarray, ...]:
            return _fitted(records, chunk)

        arrays = coefficient, reach, variance, expected, around, weight
        for chunk, found in _each(fit, n, workers):
            for array, values in zip(arrays, found, strict=True):
                array[chunk] = values
        off2 = (coefficient[:, :, 0].mean(axis=2) - records.light.mean(axis=1)[:, None]) ** 2
        surplus = off2 - _CHANCE * expected
        for i, times in enumerate(_TIMES):
            for _ in range(times):
                workers.progress.check()
                surplus[:, i] = (weight * surplus[around, i]).sum(axis=1)
        own = records.stderr[:, None].astype(np.float64) ** 2
        errors = np.concatenate([own, variance + _LOCAL * np.maximum(surplus, 0)], axis=1)
        trust = np.maximum(errors, 1e-30) ** -2
        trust /= trust.sum(axis=1, keepdims=True)
        return _Fits(records, coefficient, reach, trust[:, 1:].astype(np.float32), (trust * errors).sum(axis=1))

    def at(
        self, position: np.ndarray, normal: np.ndarray, light: np.ndarray, stderr: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Light (n, 3) of receivers without noise, and its standard error (n,), from their own."""
        records = self.records
        distance, near = records.nearest(position, normal, _NEAREST + 1)
        reach, near = np.maximum(distance[:, -1], np.float32(1e-12)), near[:, :-1]
        way = position[:, None] - rows(records.position, near.ravel()).reshape(*near.shape, 3)
        weight = records.weights(way, normal, near, reach) + np.float32(1e-6)
        weight /= weight.sum(axis=1, keepdims=True)
        x, y = (np.einsum("nki,nki->nk", way, rows(axis, near.ravel()).reshape(way.shape)) for axis in records.axes)
        share = weight[..., None] * self.share[near]
        unit = self.reach[near]
        terms = _terms(x[..., None] / unit, y[..., None] / unit)
        fitted = np.einsum("nks,nksa,nksac->nc", share, terms, self.coefficient[near])
        total = share.sum(axis=(1, 2))
        change = fitted - total[:, None] * light
        most = np.float32(MOST) * stderr / np.maximum(np.abs(change).mean(axis=1), np.float32(1e-30))
        error2 = ((1 - total) * stderr) ** 2 + total**2 * (weight * self.variance[near]).sum(axis=1)
        return light + change * np.minimum(most, 1)[:, None], np.sqrt(np.minimum(error2, stderr**2))


def _fitted(records: _Records, chunk: slice) -> tuple[np.ndarray, ...]:
    """Of a chunk of records: coefficients, reach, variance and expected difference of their fits; those around them."""
    position, normal = records.position[chunk], records.normal[chunk]
    distance, near = records.nearest(position, normal, N_NEIGHBOURS[-1])
    way = rows(records.position, near.ravel()).reshape(*near.shape, 3) - position[:, None]
    x, y = (np.einsum("nki,ni->nk", way, axis[chunk]) for axis in records.axes)
    variance = records.stderr**2
    fits = []
    for number in (min(n, near.shape[1]) for n in N_NEIGHBOURS):
        some, reach = near[:, :number], distance[:, number - 1] + np.float32(1e-12)
        weight = records.weights(way[:, :number], normal, some, reach)
        terms = _terms(x[:, :number] / reach[:, None], y[:, :number] / reach[:, None]).astype(np.float64)
        weighted = weight[..., None] * terms
        matrix = terms.transpose(0, 2, 1) @ weighted + _RIDGE * np.eye(6) * weight.sum(axis=1)[:, None, None]
        inverse = np.linalg.inv(matrix)
        own = (inverse[:, :1] @ weighted.transpose(0, 2, 1))[:, 0]  # what each record adds to the light in the middle
        of_fit = (own**2 * variance[some]).sum(axis=1)
        expected = np.maximum(variance[chunk] * (1 - 2 * own[:, 0]) + of_fit, 0)
        total = weighted.transpose(0, 2, 1) @ rows(records.light, some.ravel()).reshape(*some.shape, 3)
        fits.append((inverse @ total, reach, of_fit, expected))
    n = min(_AROUND, near.shape[1])
    around = records.weights(way[:, :n], normal, near[:, :n], distance[:, n - 1] + np.float32(1e-12))
    around /= np.maximum(around.sum(axis=1, keepdims=True), np.float32(1e-30))
    return *(np.stack(arrays, axis=1) for arrays in zip(*fits, strict=True)), near[:, :n], around


def _terms(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """What the coefficients of a parabola count at places, (…, 6)."""
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)


def _bump(x2: np.ndarray) -> np.ndarray:
    """1 − x² where that is positive, of squares."""
    return np.maximum(1 - x2, 0)


def _each(work: Any, n: int, workers: Workers) -> Any:
    """Chunks of ``range(n)`` with what `work` makes of them, in order."""
    chunks = list(slices(n, _CHUNK))
    for chunk, result in zip(chunks, workers.map(work, chunks), strict=True):
        yield chunk, result
        workers.progress.update(STAGE, chunk.stop / n)
