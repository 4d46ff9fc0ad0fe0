"""Gathered light to values of vertices."""

from dataclasses import dataclass

import numpy as np

from ...core.parallel import Workers
from ...gather import Irradiance
from ...receivers import FaceSamples, Receivers, ShownFaces
from ...tracing import Tracer
from .denoise import denoised
from .fit import FaceFit

STAGE = "Fitting vertices"

DARK = 0.25
"""Of the mean light of its object, up to which a hidden point has no say."""

ALL_HIDDEN = 0.95
"""Of an object's points: it is in a room whose surfaces face outwards, where nothing is hidden."""

LEAST_LIGHT = 0.25
"""Of all objects' mean light, to which errors on darker ones are compared, as refining does: hardly seen there."""

_FACES = 1 << 17  # of objects that are fitted together


@dataclass(frozen=True)
class VertexSamples:
    """What vertices are fitted to.

    Attributes
    ----------
    faces : ShownFaces
        Of all objects, one after the other.
    samples : FaceSamples
    hidden : (n,) bool
        Which of the vertices are, as samples may be.
    names : list of str
        The object of each target.
    receivers : Receivers
        Of vertices, and after them of samples.
    extent : float, m
        Of most vertices.
    """

    faces: ShownFaces
    samples: FaceSamples
    hidden: np.ndarray
    names: list[str]
    receivers: Receivers
    extent: float


@dataclass(frozen=True)
class FinishedVertices:
    """Light of n vertices, ready to be stored.

    Attributes
    ----------
    irradiance : Irradiance
    residuals : dict of str to float
        By object: how far the light between its vertices is from linear, root mean square over its faces as a share of
        the light's mean there, or of `LEAST_LIGHT` of all objects' mean if that is more, less what noise makes of it.
        Objects whose faces need no samples are not in it.
    """

    irradiance: Irradiance
    residuals: dict[str, float]


def finish_vertices(
    light: Irradiance, at: VertexSamples, workers: Workers, denoise_by: Tracer | None = None
) -> FinishedVertices:
    """The values of vertices from the light of n vertices and, after them, of s samples.

    Parameters
    ----------
    denoise_by : Tracer, optional
        For what stands between points; without it, noise stays.
    """
    n, faces, samples = len(at.hidden), at.faces, at.samples
    has_say = _has_say(light.value, at)
    if denoise_by is not None:
        light = denoised(light, at.receivers, has_say, at.extent, denoise_by, workers)
    passes = {name: values[:n].copy() for name, values in light.passes.items()}
    stderr = light.stderr[:n].copy()
    of_names: dict[str, np.ndarray] = {}
    workers.progress.update(STAGE, 0)
    for some in _pieces(faces.target):
        first, end = int(faces.receiver[some].min()), int(faces.receiver[some].max()) + 1
        chosen = slice(*np.searchsorted(samples.face, [some.start, some.stop]))
        vertices, own = slice(first, end), slice(n + chosen.start, n + chosen.stop)
        piece_faces, piece_samples = _faces_of(faces, some, first), samples.where(chosen, some.start)
        fit = FaceFit.of(piece_faces, piece_samples, end - first, has_say[vertices], has_say[own])
        shown = np.zeros((len(piece_samples), 3))
        for name, values in light.passes.items():
            fitted = fit.values(values[vertices], values[own], workers.progress)
            passes[name][vertices] = fitted
            shown += fit.at_samples(fitted)
        stderr[vertices] = np.sqrt(fit.mean(light.stderr[vertices] ** 2, light.stderr[own] ** 2))
        off2 = (shown - light.value[own]).mean(axis=1) ** 2 - light.stderr[own].astype(np.float64) ** 2
        sums = np.stack([fit.sample_area * a for a in (off2, light.value[own].mean(axis=1), 1)], axis=1)
        target = piece_faces.target[piece_samples.face]
        for i in np.unique(target):
            of_names[at.names[i]] = of_names.get(at.names[i], 0) + sums[target == i].sum(axis=0)
        workers.progress.update(STAGE, some.stop / len(faces))
    value = np.sum(list(passes.values()), axis=0, dtype=np.float32)
    gathered = None if light.gathered is None else light.gathered[:n]
    finished = Irradiance(value, stderr, passes, light.counts, gathered=gathered)
    _, light_of_all, area_of_all = sum(of_names.values(), np.zeros(3))
    least = LEAST_LIGHT * light_of_all / max(area_of_all, 1e-30)
    return FinishedVertices(finished, {name: _relative(sums, least) for name, sums in of_names.items()})


def _relative(sums: np.ndarray, least: float) -> float:
    """Root mean square over mean, which is at `least` something, from sums that are weighted by area."""
    off2, light, area = sums.tolist()
    light = max(light, least * area)
    return float(np.sqrt(max(off2, 0) * area) / light) if light > 0 else 0.0


def _has_say(value: np.ndarray, at: VertexSamples) -> np.ndarray:
    """Which vertices and samples are seen by somebody, (n + s,) bool: those that are not hidden, or not dark."""
    faces, hidden = at.faces, np.concatenate([at.hidden, at.samples.hidden])
    target = np.zeros(len(at.hidden), np.int32)
    target[faces.receiver] = faces.target[:, None]
    target = np.concatenate([target, faces.target[at.samples.face]])
    brightness, n = value.mean(axis=1), len(at.names)
    number, n_seen = (np.maximum(np.bincount(target, counted, n), 1) for counted in (np.ones(len(target)), ~hidden))
    mean = np.bincount(target, brightness * ~hidden, n) / n_seen
    all_hidden = n_seen < (1 - ALL_HIDDEN) * number
    return ~hidden | (brightness >= DARK * mean[target]) | all_hidden[target]


def _pieces(target: np.ndarray) -> list[slice]:
    """Faces of whole targets, each piece of about `_FACES` at the most, where one target has no more."""
    if len(target) == 0:
        return []
    starts = np.flatnonzero(np.diff(target, prepend=-1))
    chosen = [0]
    for start, end in zip(starts, [*starts[1:], len(target)], strict=True):
        if end - chosen[-1] > _FACES and start > chosen[-1]:
            chosen.append(int(start))
    return [slice(a, b) for a, b in zip(chosen, [*chosen[1:], len(target)], strict=True)]


def _faces_of(faces: ShownFaces, some: slice, first: int) -> ShownFaces:
    """Some of the faces, between vertices that are numbered from `first` on."""
    return ShownFaces(
        faces.receiver[some] - first, faces.position[some], faces.normal[some], faces.area[some], faces.target[some]
    )
