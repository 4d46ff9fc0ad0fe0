"""Photons light the points within their volumes: Eq. 1 to 3 of McGuire and Luebke, for many pairs at a time.

A photon volume is an ellipsoid around the photon, of radius r along the surface and `SLICE` r along its normal. Within
it the photon's power is spread by Epanechnikov's kernel κ = 2/(πr²) (1 − t²), t being 0 in its middle and 1 on its
hull. Over the tangent plane ∫κ dA = 2/r² ∫ (1 − ρ²/r²) 2ρ dρ = 1: what a photon brings is what surfaces get.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...core.parallel import Workers
from ...core.ranges import unrolled
from ...core.sampling.vectors import dot
from ...photons import Photons
from ..density.density import SAME_SIDE, SLICE
from .point_rows import PointRows

_FOLD = 4.0  # radii that differ less share their rows of points
_ROWS_A_RADIUS = 4  # of the largest of them
_CHUNK, _PAIRS = 1 << 13, 1 << 20  # photons, and pairs of photons and points, at a time
_BYTES_A_PHOTON = 100 * (_PAIRS // _CHUNK)  # working arrays of the pairs

_SCATTERING = 82  # stream of random numbers

Response = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""What points make of the irradiance by photons, given the indices of pairs, (m,) each: a factor (m, 1) or (m, 3)."""


@dataclass(frozen=True)
class Points:
    """The n points of surfaces that are lit: position (n, 3) float32, m, and unit normal (n, 3) float32."""

    position: np.ndarray
    normal: np.ndarray

    def __len__(self) -> int:
        return len(self.position)


@dataclass(frozen=True)
class Scattered:
    """The light of photons at n points.

    Attributes
    ----------
    light : (n, 3) float32, W/m²
    stderr : (n,) float32, W/m²
        √(Σ (Φ κ)²) of the mean over colours, as of independent photons.
    radius : (n,) float32, m
        Of the volumes that light comes from, on the average.
    """

    light: np.ndarray
    stderr: np.ndarray
    radius: np.ndarray


def scatter_light(
    points: Points, photons: Photons, radius: np.ndarray, workers: Workers, response: Response | None = None
) -> Scattered:
    """Irradiance Σ Φ κ at points, or what `response` makes of it.

    Parameters
    ----------
    radius : (p,) float32, m
        Of the photons' volumes.
    """
    sums = np.zeros((5, len(points)))
    if len(points) and len(photons):
        classes = _classes(radius)
        for turn, chosen in enumerate(classes):
            part = turn / len(classes), (turn + 1) / len(classes)
            _add_class(sums, points, photons, radius, chosen, workers, response, part)
    of_light = sums[4] / np.maximum(sums[:3].mean(axis=0), 1e-30)
    return Scattered(sums[:3].T.astype(np.float32), np.sqrt(sums[3]).astype(np.float32), of_light.astype(np.float32))


def _classes(radius: np.ndarray) -> list[np.ndarray]:
    """Indices of photons whose radii are alike, smallest first."""
    fold = np.floor(np.log(np.maximum(radius, 1e-30)) / np.log(_FOLD)).astype(int)
    return [np.flatnonzero(fold == one) for one in np.unique(fold)]


def _add_class(
    sums: np.ndarray,
    points: Points,
    photons: Photons,
    radius: np.ndarray,
    chosen: np.ndarray,
    workers: Workers,
    response: Response | None,
    part: tuple[float, float],
) -> None:
    """Add to sums (5, n) what the `chosen` photons bring."""
    rows = PointRows(points.position, float(radius[chosen].max()) / _ROWS_A_RADIUS)
    chosen = chosen[rows.along(photons.position[chosen])]  # neighbours in a chunk light few rows
    in_rows = Points(points.position[rows.order], points.normal[rows.order])

    def scatter(chunk: slice, _: np.random.Generator) -> list[tuple[slice, np.ndarray]]:
        k = chosen[chunk]
        some, lit = photons.where(k), []
        for at, of, kernel in _pairs(rows, in_rows, some.position, some.normal, radius[k]):
            light = some.power.take(of, axis=0) * kernel[:, None]
            if response is not None:
                light *= response(rows.order[at], k[of])
            lit.append(_summed(at, light, radius[k[of]]))
        return lit

    chunks = workers.chunks(
        "Scattering photons", len(chosen), _CHUNK, scatter, (_SCATTERING,), part, row_bytes=_BYTES_A_PHOTON
    )
    of_rows = np.zeros_like(sums)
    for _, lit in chunks:
        for window, added in lit:
            of_rows[:, window] += added
    sums[:, rows.order] += of_rows


def _pairs(
    rows: PointRows, points: Points, x: np.ndarray, normal: np.ndarray, radius: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Pairs of a point and a photon, some at a time: indices (m,) of both, and κ (m,) float32, 1/m²."""
    # Half the sides of the box around an ellipsoid: √(r² (1 − n²) + (SLICE r)² n²)
    half = radius[:, None] * np.sqrt(1 - (1 - SLICE**2) * normal**2)
    of_run, start, stop = rows.runs(x - half, x + half)
    flat = 1 / radius**2
    for piece in _pieces(stop - start):
        run, k = unrolled((stop - start)[piece])
        at, of = start[piece].take(run) + k, of_run[piece].take(run)
        away = points.position.take(at, axis=0) - x.take(of, axis=0)
        height = dot(away, normal.take(of, axis=0))
        t2 = (dot(away, away) + (1 / SLICE**2 - 1) * height**2) * flat.take(of)
        near = np.flatnonzero(t2 < 1)
        at, of = at.take(near), of.take(near)
        same = np.flatnonzero(dot(points.normal.take(at, axis=0), normal.take(of, axis=0)) > SAME_SIDE)
        of = of.take(same)
        yield at.take(same), of, np.float32(2 / np.pi) * flat.take(of) * (1 - t2.take(near.take(same)))


def _pieces(lengths: np.ndarray) -> Iterator[slice]:
    """Slices of runs that hold about `_PAIRS` points together."""
    ends = np.cumsum(lengths)
    cuts = np.searchsorted(ends, np.arange(_PAIRS, ends[-1] if len(ends) else 0, _PAIRS))
    cuts = np.unique(np.concatenate([[0], cuts, [len(lengths)]]))
    return (slice(start, stop) for start, stop in pairwise(cuts.tolist()))


def _summed(at: np.ndarray, light: np.ndarray, radius: np.ndarray) -> tuple[slice, np.ndarray]:
    """Sums of light (m, 3), of its mean over colours squared and times the radius, in a window of points, (5, w)."""
    if len(at) == 0:
        return slice(0, 0), np.zeros((5, 0))
    first, (r, g, b) = at.min(), light.T
    mean = (r + g + b) / 3
    sums = np.stack([np.bincount(at - first, column) for column in (r, g, b, mean**2, mean * radius)])
    return slice(first, first + sums.shape[1]), sums
