"""Noise out of gathered light, over surfaces: local polynomials as wide as light lets them be.

What receivers that gathered (records) found by their own rays has independent noise of a known size. Around each,
parabolas are fitted to it over the nearest records (weighted least squares in the tangent plane), over few and over
many. The light t that the receiver has taken so far has the squared error e. A fit has the variance v and, where light
is no parabola, a bias b. It is the better the more records it takes: its difference from t is then independent of its
own noise (Hausman), and has the mean square e − v + b². So the mean of these squares over the surroundings tells b².
Light and fits, with a mean squared error of e and v + B b², are mixed by the inverse squares of these errors; B > 1, as
a mean dilutes what is wrong in one place. All other receivers change as the records nearest to them do. None changes by
more than `MOST` standard errors.

The neighbours are found by place and normal alike, whatever object they are on; what faces another way or lies above or
below the tangent plane does not count, nor what is behind something that stands on the surface: rays in `_WAYS`
directions just above it tell how far each record sees. Caustics, which are sharp, and direct light stay as they are.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...core.parallel import Workers
from ...core.sampling.vectors import rows
from ...core.sampling.warps import frame
from ...gather import Irradiance
from ...receivers import Receivers
from ...tracing import Tracer

STAGE = "Denoising vertices"

N_NEIGHBOURS = (48, 100)
"""Records that fits are made of: noise at a parabola's middle is a fifth of a record's then, or a seventh."""

MOST = 2.5

_TURN = 1.0  # of the extent: a record as far away counts as near as one at the same place that is turned by 57°
_TILT = 0.5  # difference of unit normals at which a record counts no more
_HEIGHT = 0.25  # of the farthest record's distance, above or below the tangent plane, at which one counts no more
_RIDGE = (1e-6, 0.02, 0.02, 0.05, 0.05, 0.05)  # of the weights: how far few records may be extrapolated
_CHANCE = 1.25  # times the squared differences that noise makes: by as much they may be more by chance
_LOCAL = 8.0
"""B, as measured: where b² is largest, along edges, kinks and small spots of light without noise, its mean over the
surroundings is smaller by 3 to 9 times over scattered records, and by 2 to 4 on a grid of them."""

_AROUND, _TIMES = 24, (2, 4)  # records that differences are averaged over, so many times for each fit
_NEARLY = 0.3  # relative: as much farther than the nearest records those may be that are found
_NEAREST = 4  # records that a receiver changes with
_WAYS, _RISE = 16, 0.2  # directions along the surface, and their slope: what rises less above it is nothing
_CHUNK = 2048
_RECORD_BYTES = N_NEIGHBOURS[-1] * 150


def denoised(
    light: Irradiance, receivers: Receivers, has_say: np.ndarray, extent: float, tracer: Tracer, workers: Workers
) -> Irradiance:
    """Light of n receivers without most of its noise, where they gathered themselves or took it from those that did.

    Parameters
    ----------
    has_say : (n,) bool
        Of the receivers: the light of others is hidden, and counts for nobody else.
    extent : float, m
        Of most receivers.
    tracer : Tracer
        For what stands between them.
    """
    own = light.own_rays
    if own is None or light.gathered is None or not own.taken.any():
        return light
    k = np.flatnonzero(light.gathered & has_say)
    if len(k) < 2 * _NEAREST:
        return light
    indirect = light.passes["indirect"]
    taken = indirect[k] - (np.float32(0) if light.caustics is None else light.caustics[k])
    at = rows(receivers.position, k), rows(receivers.normal, k)
    records = _Records(*at, taken, taken + own.off[k], own.taken[k], own.stderr[k], extent, tracer)
    changes = _Changes.of(records, workers.part(0, 0.8))
    change, error = np.zeros_like(indirect), own.taken.copy()
    those = np.flatnonzero(has_say)

    def take(chunk: slice, _: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        i = those[chunk]
        return changes.at(rows(receivers.position, i), rows(receivers.normal, i), own.taken[i])

    last = workers.part(0.8, 1)
    for chunk, (value, stderr) in last.chunks(STAGE, len(those), _CHUNK, take, (), row_bytes=_RECORD_BYTES):
        change[those[chunk]], error[those[chunk]] = value, stderr
    lowest = min(float(indirect.min()), 0.0)
    passes = {**light.passes, "indirect": np.maximum(indirect + change, lowest)}
    stderr = np.sqrt(np.maximum(light.stderr**2 - own.taken**2, 0) + error**2)
    return replace(light, value=np.sum(list(passes.values()), axis=0, dtype=np.float32), stderr=stderr, passes=passes)


@dataclass(frozen=True)
class _Records:
    """m receivers that gathered: where they are, what light they took and what their own rays found (m, 3), and the
    standard errors of both (m,).
    """

    position: np.ndarray
    normal: np.ndarray
    taken: np.ndarray
    light: np.ndarray
    error: np.ndarray
    stderr: np.ndarray
    extent: float
    tracer: Tracer

    def __len__(self) -> int:
        return len(self.position)

    @cached_property
    def tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self._place(self.position, self.normal), balanced_tree=False)  # faster: 0.7 times the seconds

    def _place(self, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
        return np.concatenate([position, np.float32(_TURN * self.extent) * normal], axis=1)

    def nearest(self, position: np.ndarray, normal: np.ndarray, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Distance and number of the k records nearest to points, (n, k) each."""
        distance, near = self.tree.query(self._place(position, normal), min(k, len(self)), eps=_NEARLY)
        return distance.reshape(len(position), -1).astype(np.float32), near.reshape(len(position), -1).astype(np.int32)

    def weights(self, way: np.ndarray, normal: np.ndarray, near: np.ndarray, reach: np.ndarray) -> np.ndarray:
        """How much records `near` (n, k) count at points that see them at `way` (n, k, 3), up to a reach (n,)."""
        height = np.einsum("nki,ni->nk", way, normal)
        turn = np.einsum("nki,ni->nk", rows(self.normal, near), normal)
        tilt2 = np.maximum(2 - 2 * turn, 0)
        reach = reach[:, None]
        weight = _bump(np.einsum("nki,nki->nk", way, way) / reach**2) * _bump(tilt2 / np.float32(_TILT**2))
        return weight * _bump((height / (np.float32(_HEIGHT) * reach)) ** 2)

    def nearness(self, chunk: slice, reach: np.ndarray) -> np.ndarray:
        """Of what stands on the surface around some records, within reach (c,): 1/distance for each way, (c, ways)."""
        position, normal = self.position[chunk], self.normal[chunk]
        tangent, bitangent = frame(normal)
        found = np.empty((len(position), _WAYS), np.float32)
        for i, angle in enumerate(2 * np.pi * np.arange(_WAYS, dtype=np.float32) / _WAYS):
            way = np.cos(angle) * tangent + np.sin(angle) * bitangent + np.float32(_RISE) * normal
            way /= np.float32(np.hypot(1, _RISE))
            found[:, i] = np.hypot(1, _RISE) / np.maximum(self.tracer.closest_hit(position, way, reach).distance, 1e-6)
        return found


@dataclass(frozen=True)
class _Changes:
    """How the light of records changes, (m, 3), what remains of its squared error, (m,) as a share, and how near things
    are to them, (m, ways).
    """

    records: _Records
    change: np.ndarray
    left: np.ndarray
    nearness: np.ndarray

    @staticmethod
    def of(records: _Records, workers: Workers) -> "_Changes":
        """By fits to the records, as far as each is trusted."""
        n, n_fits, n_around = len(records), len(N_NEIGHBOURS), min(_AROUND, len(records))
        fitted, variance = np.empty((n, n_fits, 3), np.float32), np.empty((n, n_fits), np.float32)
        around, weight = np.empty((n, n_around), np.int32), np.empty((n, n_around), np.float32)
        nearness = np.empty((n, _WAYS), np.float32)
        arrays = fitted, variance, around, weight, nearness
        assert records.tree is not None  # made before threads need it

        def fit(chunk: slice, _: np.random.Generator) -> tuple[np.ndarray, ...]:
            return _fitted(records, chunk, workers.progress.check)

        for chunk, found in workers.chunks(STAGE, n, _CHUNK, fit, (), row_bytes=_RECORD_BYTES):
            for array, values in zip(arrays, found, strict=True):
                array[chunk] = values
        taken, own = records.error[:, None] ** 2, records.stderr[:, None] ** 2
        noise = np.maximum(np.minimum(taken, own) - variance, 0)
        surplus = (fitted - records.taken[:, None]).mean(axis=2) ** 2 - _CHANCE * noise
        for i, times in enumerate(_TIMES):
            for _ in range(times):
                workers.progress.check()
                surplus[:, i] = np.einsum("nk,nk->n", weight, surplus[around, i])
        of_fits = variance + _LOCAL * np.maximum(surplus, 0)
        errors = np.concatenate([taken, own, of_fits], axis=1).astype(np.float64)
        trust = np.maximum(errors, 1e-30) ** -2
        trust /= trust.sum(axis=1, keepdims=True)
        values = np.concatenate([records.light[:, None], fitted], axis=1) - records.taken[:, None]
        change = np.einsum("nf,nfc->nc", trust[:, 1:], values).astype(np.float32)
        left = (trust * errors).sum(axis=1) / np.maximum(errors[:, 0], 1e-30)
        return _Changes(records, change, np.minimum(left, 1).astype(np.float32), nearness)

    def at(self, position: np.ndarray, normal: np.ndarray, error: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How the light of receivers changes, (n, 3), and its standard error then, (n,), from that before."""
        distance, near = self.records.nearest(position, normal, _NEAREST + 1)
        reach, near = np.maximum(distance[:, -1], np.float32(1e-12)), near[:, :-1]
        way = rows(self.records.position, near) - position[:, None]
        weight = self.records.weights(way, normal, near, reach)
        axes = frame(rows(self.records.normal, near.ravel()))
        x, y = (np.einsum("nki,nki->nk", way, axis.reshape(way.shape)) for axis in axes)
        weight *= ~_blocked(-x, -y, rows(self.nearness, near))
        weight /= np.maximum(weight.sum(axis=1, keepdims=True), np.float32(1e-12))
        change = np.einsum("nk,nkc->nc", weight, rows(self.change, near))
        most = np.float32(MOST) * error / np.maximum(np.abs(change.mean(axis=1)), np.float32(1e-30))
        left = 1 - np.einsum("nk,nk->n", weight, 1 - self.left[near])
        return change * np.minimum(most, 1)[:, None], error * np.sqrt(np.maximum(left, 0))


def _fitted(records: _Records, chunk: slice, check: Callable[[], None]) -> tuple[np.ndarray, ...]:
    """Of a chunk of records: light and variance of their fits, those around them, how much these count,
    and what `nearness` tells.
    """
    position, normal = records.position[chunk], records.normal[chunk]
    distance, near = records.nearest(position, normal, N_NEIGHBOURS[-1])
    way = rows(records.position, near) - position[:, None]
    x, y = (np.einsum("nki,ni->nk", way, axis) for axis in frame(normal))
    nearness = records.nearness(chunk, distance[:, -1])
    seen = ~_blocked(x, y, nearness[:, None])
    variance = records.stderr**2
    light, of_fit = [], []
    for number in (min(n, near.shape[1]) for n in N_NEIGHBOURS):
        check()
        some, reach = near[:, :number], distance[:, number - 1] + np.float32(1e-12)
        weight = records.weights(way[:, :number], normal, some, reach) * seen[:, :number]
        own = _parabola(x[:, :number] / reach[:, None], y[:, :number] / reach[:, None], weight)
        of_fit.append(np.einsum("nk,nk->n", own**2, variance[some]))
        light.append(np.einsum("nk,nkc->nc", own, rows(records.light, some)))
    n = min(_AROUND, near.shape[1])
    around = records.weights(way[:, :n], normal, near[:, :n], distance[:, n - 1] + np.float32(1e-12)) * seen[:, :n]
    around /= np.maximum(around.sum(axis=1, keepdims=True), np.float32(1e-30))
    return np.stack(light, axis=1), np.stack(of_fit, axis=1), near[:, :n], around, nearness


def _blocked(x: np.ndarray, y: np.ndarray, nearness: np.ndarray) -> np.ndarray:
    """Whether something stands between records and places (n, k) around them, (n, k) bool.

    In all ways to a straight wall the inverse distance to it is a cosine, and so is about linear between two of them.

    Parameters
    ----------
    nearness : (n, 1 or k, ways) float32, 1/m
    """
    way = np.arctan2(y, x) * np.float32(_WAYS / (2 * np.pi))
    first = np.floor(way).astype(np.int32)
    share = way - first
    near, next_ = (np.take_along_axis(nearness, (first + i)[..., None] % _WAYS, axis=2)[..., 0] for i in (0, 1))
    return np.hypot(x, y) * (near + share * (next_ - near)) > 1


def _parabola(x: np.ndarray, y: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """What records at places (n, k) add to the value at 0 of the parabola that is fitted to them, (n, k) float32."""
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    matrix = (weight[:, None] * terms) @ terms.transpose(0, 2, 1)
    return weight * np.einsum("nt,ntk->nk", _first_solution(matrix, weight.sum(axis=1)), terms)


def _first_solution(matrix: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """First column of the inverses of positive definite matrices (n, 6, 6) with the ridge times `scale` (n,) added.

    Elimination of the last row first leaves only forward substitution for the first column; over all matrices at once
    that takes a twentieth of the time of `numpy.linalg.solve`.
    """
    a = matrix.transpose(1, 2, 0).astype(np.float64)
    n = len(a)
    for i, ridge in enumerate(_RIDGE):
        a[i, i] += ridge * scale + 1e-30
    for i in range(n - 1, 0, -1):
        for j in range(i):
            a[j, : j + 1] -= a[i, j] / a[i, i] * a[i, : j + 1]
    solution = np.empty((n, a.shape[2]))
    solution[0] = 1 / a[0, 0]
    for i in range(1, n):
        solution[i] = -(a[i, :i] * solution[:i]).sum(axis=0) / a[i, i]
    return solution.T.astype(np.float32)


def _bump(x2: np.ndarray) -> np.ndarray:
    """1 − x² where that is positive, of squares."""
    return np.maximum(1 - x2, 0)
