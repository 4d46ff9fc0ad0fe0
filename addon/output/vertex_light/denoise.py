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

from dataclasses import replace
from typing import NamedTuple, cast

import numpy as np

from ...core.compiling import kernel, part
from ...core.nearest import PointTree, find_nearest, new_search
from ...core.parallel import Workers
from ...core.sampling.vectors import rows
from ...core.vec3 import ONE, ZERO, dot, frame, minus, plus, put, row, times
from ...gather import Irradiance
from ...receivers import Receivers
from ...scene import RayKind
from ...tracing import Tracer
from ...tracing.embree import EmbreeTracer, intersect, new_ray

STAGE = "Denoising vertices"

N_NEIGHBOURS = (48, 100)
"""Records that fits are made of: noise at a parabola's middle is a fifth of a record's then, or a seventh."""

MOST = 2.5

_TILT2 = np.float32(0.25)  # squared difference of unit normals at which a record counts no more
_HEIGHT = np.float32(0.25)  # of the farthest record's distance, over the tangent plane, at which one counts no more
_RIDGE = (1e-6, 0.02, 0.02, 0.05, 0.05, 0.05)  # of the weights: how far few records may be extrapolated
_CHANCE = 1.25  # times the squared differences that noise makes: by as much they may be more by chance
_LOCAL = 8.0
"""B, as measured: where b² is largest, along edges, kinks and small spots of light without noise, its mean over the
surroundings is smaller by 3 to 9 times over scattered records, and by 2 to 4 on a grid of them."""

_AROUND, _TIMES = 24, (2, 4)  # records that differences are averaged over, so many times for each fit
_NEARLY = np.float32(1.3**2)  # as much farther, squared, than the nearest records those may be that are found
_NEAREST = 4  # records that a receiver changes with
_WAYS, _RISE = 16, np.float32(0.2)  # directions along the surface, and their slope: what rises less above is nothing
_TERMS = 6  # of a parabola
_CLOSE, _TINY = np.float32(1e-6), np.float32(1e-12)
_CHUNK, _RECORD_CHUNK = 1 << 14, 1 << 9


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
    records = _Records(PointTree.of(*at, extent), *at, taken, taken + own.off[k], own.taken[k], own.stderr[k])
    changes = _changes(records, cast(EmbreeTracer, tracer), workers.part(0, 0.8))
    change, error = np.zeros_like(indirect), own.taken.copy()
    those = np.flatnonzero(has_say)

    def take(chunk: slice, _: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        i = those[chunk]
        value, stderr = np.empty((len(i), 3), np.float32), own.taken[i]
        at = rows(receivers.position, i), rows(receivers.normal, i)
        _take_changes(records, changes, new_search(min(_NEAREST + 1, len(k))), *at, value, stderr)
        return value, stderr

    for chunk, (value, stderr) in workers.part(0.8, 1).chunks(STAGE, len(those), _CHUNK, take, ()):
        change[those[chunk]], error[those[chunk]] = value, stderr
    lowest = min(float(indirect.min()), 0.0)
    passes = {**light.passes, "indirect": np.maximum(indirect + change, lowest)}
    stderr = np.sqrt(np.maximum(light.stderr**2 - own.taken**2, 0) + error**2)
    return replace(light, value=np.sum(list(passes.values()), axis=0, dtype=np.float32), stderr=stderr, passes=passes)


class _Records(NamedTuple):
    """m receivers that gathered: where they are, what light they took and what their own rays found (m, 3), and the
    standard errors of both (m,).
    """

    tree: PointTree
    position: np.ndarray
    normal: np.ndarray
    taken: np.ndarray
    light: np.ndarray
    error: np.ndarray
    stderr: np.ndarray


class _Changes(NamedTuple):
    """How the light of records changes, (m, 3), what remains of its squared error, (m,) as a share, and how near things
    are to them, (m, ways).
    """

    change: np.ndarray
    left: np.ndarray
    nearness: np.ndarray


class _Fits(NamedTuple):
    """What c records have of those around them.

    Attributes
    ----------
    light : (c, f, 3) float32, variance : (c, f) float32
        Of their fits.
    around, weight : (c, 24) int32 and float32
        Records whose differences count here, and how much: sums are one, or 0.
    nearness : (c, ways) float32, 1/m
        1/distance of what stands on the surface, within reach of the largest fit.
    """

    light: np.ndarray
    variance: np.ndarray
    around: np.ndarray
    weight: np.ndarray
    nearness: np.ndarray

    @staticmethod
    def empty(n: int, n_around: int) -> "_Fits":
        light, variance = np.empty((n, len(N_NEIGHBOURS), 3), np.float32), np.empty((n, len(N_NEIGHBOURS)), np.float32)
        around, weight = np.empty((n, n_around), np.int32), np.empty((n, n_around), np.float32)
        return _Fits(light, variance, around, weight, np.empty((n, _WAYS), np.float32))


class _Fit(NamedTuple):
    """Memory for a fit: places of k records in the tangent plane and how much they count; 6 × 6 sums, a solution."""

    x: np.ndarray
    y: np.ndarray
    weight: np.ndarray
    matrix: np.ndarray
    solution: np.ndarray


def _changes(records: _Records, tracer: EmbreeTracer, workers: Workers) -> _Changes:
    """How records change by fits to the records, as far as each is trusted."""
    n, k = len(records.position), min(N_NEIGHBOURS[-1], len(records.position))
    fits, numbers = _Fits.empty(n, min(_AROUND, n)), np.array([min(number, k) for number in N_NEIGHBOURS])

    def fit(chunk: slice, _: np.random.Generator) -> None:
        x, y, weight = np.empty((3, k), np.float32)
        memory = _Fit(x, y, weight, np.empty((_TERMS, _TERMS)), np.empty(_TERMS))
        some = _Fits(*(values[chunk] for values in fits))
        tree = tracer.handles[RayKind.DIFFUSE]
        _fit_around(records, tree, new_ray(), new_search(k), memory, chunk.start, numbers, some)

    for _ in workers.chunks(STAGE, n, _RECORD_CHUNK, fit, ()):
        pass
    taken, own = records.error[:, None] ** 2, records.stderr[:, None] ** 2
    noise = np.maximum(np.minimum(taken, own) - fits.variance, 0)
    surplus = (fits.light - records.taken[:, None]).mean(axis=2) ** 2 - _CHANCE * noise
    for i, times_ in enumerate(_TIMES):
        for _ in range(times_):
            workers.progress.check()
            surplus[:, i] = np.einsum("nk,nk->n", fits.weight, surplus[fits.around, i])
    of_fits = fits.variance + _LOCAL * np.maximum(surplus, 0)
    errors = np.concatenate([taken, own, of_fits], axis=1).astype(np.float64)
    trust = np.maximum(errors, 1e-30) ** -2
    trust /= trust.sum(axis=1, keepdims=True)
    values = np.concatenate([records.light[:, None], fits.light], axis=1) - records.taken[:, None]
    change = np.einsum("nf,nfc->nc", trust[:, 1:], values).astype(np.float32)
    left = (trust * errors).sum(axis=1) / np.maximum(errors[:, 0], 1e-30)
    return _Changes(change, np.minimum(left, 1).astype(np.float32), fits.nearness)


@kernel
def _fit_around(records, tree, room, search, memory, first, numbers, fits):
    """Write what is around records, those from the `first` on."""
    n_around = fits.around.shape[1]
    for i in range(len(fits.around)):
        at, up = row(records.position, first + i), row(records.normal, first + i)
        find_nearest(records.tree, search, at, up, _NEARLY)
        tangent, bitangent = frame(up)
        _look_along(tree, room, at, up, np.sqrt(search.distance2[len(search.number) - 1]), fits.nearness, i)
        for j in range(len(search.number)):
            way = minus(row(records.position, search.number[j]), at)
            memory.x[j], memory.y[j] = dot(way, tangent), dot(way, bitangent)
        for f in range(len(numbers)):
            reach = np.sqrt(search.distance2[numbers[f] - 1]) + _TINY
            _weigh(records, search.number, memory, at, up, reach, numbers[f], fits.nearness, i)
            _fit_parabola(records, search.number, memory, reach, numbers[f], fits, i, f)
        reach = np.sqrt(search.distance2[n_around - 1]) + _TINY
        total = _weigh(records, search.number, memory, at, up, reach, n_around, fits.nearness, i)
        for j in range(n_around):
            fits.around[i, j], fits.weight[i, j] = search.number[j], memory.weight[j] / max(total, np.float32(1e-30))


@part
def _look_along(tree, room, at, up, reach, nearness, i):
    """Of what stands on the surface around a place, within reach: 1/distance for each way."""
    tangent, bitangent = frame(up)
    stretch = np.sqrt(ONE + _RISE * _RISE)
    for j in range(_WAYS):
        angle = np.float32(2 * np.pi / _WAYS) * np.float32(j)
        way = plus(times(tangent, np.cos(angle)), plus(times(bitangent, np.sin(angle)), times(up, _RISE)))
        _, distance, _, _ = intersect(tree, room, at, times(way, ONE / stretch), reach)
        nearness[i, j] = stretch / max(distance, _CLOSE)


@part
def _weigh(records, number, memory, at, up, reach, n, nearness, i):
    """How much each of n records counts at a place, up to a reach; returns their sum."""
    total = ZERO
    for j in range(n):
        memory.weight[j] = ZERO
        if not _blocked(memory.x[j], memory.y[j], nearness, i):
            memory.weight[j] = _closeness(records, number[j], at, up, reach)
        total += memory.weight[j]
    return total


@part
def _closeness(records, record, at, up, reach):
    """How much a record counts at a place from which it is seen, up to a reach."""
    way = minus(row(records.position, record), at)
    tilt2 = max(np.float32(2) - np.float32(2) * dot(row(records.normal, record), up), ZERO)
    height = dot(way, up) / (_HEIGHT * reach)
    return _bump(dot(way, way) / (reach * reach)) * _bump(tilt2 / _TILT2) * _bump(height * height)


@part
def _bump(x2):
    """1 − x² where that is positive, of squares."""
    return max(ONE - x2, ZERO)


@part
def _blocked(x, y, nearness, i):
    """Whether something stands between the i-th record and a place (x, y) in its tangent plane.

    In all ways to a straight wall the inverse distance to it is a cosine, and so is about linear between two of them.
    """
    way = np.arctan2(y, x) * np.float32(_WAYS / (2 * np.pi))
    first = np.floor(way)
    share, j = way - first, np.int64(first) % _WAYS
    near, next_ = nearness[i, j], nearness[i, (j + 1) % _WAYS]
    return np.sqrt(x * x + y * y) * (near + share * (next_ - near)) > ONE


@part
def _fit_parabola(records, number, memory, reach, n, fits, i, f):
    """Light and variance, at the middle, of the parabola that is fitted to n records."""
    matrix, solution, total = memory.matrix, memory.solution, np.float64(0)
    matrix[:] = 0.0
    for j in range(n):
        terms, weight = _terms(memory.x[j] / reach, memory.y[j] / reach), np.float64(memory.weight[j])
        total += weight
        for a in range(_TERMS):
            for b in range(a + 1):
                matrix[a, b] += weight * terms[a] * terms[b]
    _first_column(matrix, solution, total)
    light, variance = (0.0, 0.0, 0.0), 0.0
    for j in range(n):
        terms, share = _terms(memory.x[j] / reach, memory.y[j] / reach), 0.0
        for a in range(_TERMS):
            share += solution[a] * terms[a]
        share *= memory.weight[j]
        light = plus(light, times(row(records.light, number[j]), share))
        variance += (share * records.stderr[number[j]]) ** 2
    for c in range(3):
        fits.light[i, f, c] = light[c]
    fits.variance[i, f] = variance


@part
def _terms(x, y):
    u, v = np.float64(x), np.float64(y)
    return 1.0, u, v, u * u, u * v, v * v


@part
def _first_column(matrix, solution, scale):
    """First column of the inverse of a positive definite matrix, its lower half given, with the ridge added.

    Elimination of the last row first leaves only forward substitution for the first column.
    """
    for i in range(_TERMS):
        matrix[i, i] += _RIDGE[i] * scale + 1e-30
    for i in range(_TERMS - 1, 0, -1):
        for j in range(i):
            factor = matrix[i, j] / matrix[i, i]
            for k in range(j + 1):
                matrix[j, k] -= factor * matrix[i, k]
    solution[0] = 1.0 / matrix[0, 0]
    for i in range(1, _TERMS):
        total = 0.0
        for k in range(i):
            total += matrix[i, k] * solution[k]
        solution[i] = -total / matrix[i, i]


@kernel
def _take_changes(records, changes, search, position, normal, value, stderr):
    """How the light of receivers changes, as the records nearest to them do, and its standard error then."""
    nearest = len(search.number) - 1
    for i in range(len(position)):
        at, up = row(position, i), row(normal, i)
        find_nearest(records.tree, search, at, up, _NEARLY)
        reach = max(np.sqrt(search.distance2[nearest]), _TINY)
        change, left, total = (ZERO, ZERO, ZERO), ZERO, ZERO
        for j in range(nearest):
            record = search.number[j]
            tangent, bitangent = frame(row(records.normal, record))
            way = minus(at, row(records.position, record))
            if not _blocked(dot(way, tangent), dot(way, bitangent), changes.nearness, record):
                weight = _closeness(records, record, at, up, reach)
                total += weight
                change = plus(change, times(row(changes.change, record), weight))
                left += weight * (ONE - changes.left[record])
        total = max(total, _TINY)
        change = times(change, ONE / total)
        mean = abs(change[0] + change[1] + change[2]) / np.float32(3)
        most = np.float32(MOST) * stderr[i] / max(mean, np.float32(1e-30))
        put(value, i, times(change, min(most, ONE)))
        stderr[i] *= np.sqrt(max(ONE - left / total, ZERO))
