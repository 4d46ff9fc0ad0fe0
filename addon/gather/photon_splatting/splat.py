"""Photons light the points within their splats: Eq. 1 to 3 of McGuire and Luebke, for many pairs at a time.

A splat is the bounding volume of what a photon lights: an ellipsoid around it, of radius r along the surface and
`SLICE` r along its normal. Within it the photon's power is spread by Epanechnikov's kernel κ = 2/(πr²) (1 − t²), t
being 0 in its middle and 1 on its hull. Over the tangent plane ∫κ dA = 2/r² ∫ (1 − ρ²/r²) 2ρ dρ = 1: what a photon
brings is what surfaces get.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core.compiling import by_reference, kernel, part
from ...core.parallel import Workers
from ...core.vec3 import ONE, dot, mean, minus, mul, plus, row, times
from ...photons import Photons
from ..density.density import SAME_SIDE, SLICE
from .point_rows import PointRows, first_from, key, steps

_FOLD = 4.0  # radii that differ less share their rows of points
_ROWS_A_RADIUS = 4  # of the largest of them
_CHUNK, _PAIRS = 1 << 13, 1 << 19  # photons, and pairs of photons and points, at a time
_BYTES_A_PHOTON = 100 * (_PAIRS // _CHUNK)  # working arrays of the pairs
_FLATNESS = ONE / SLICE**2 - ONE
_PEAK = np.float32(2 / np.pi)

_SCATTERING = 82  # stream of random numbers

Response = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""What points make of the irradiance by photons, given the indices of pairs, (m,) each: a factor (m, 1) or (m, 3)."""


@dataclass(frozen=True)
class LitPoints:
    """The n points of surfaces that are lit: position (n, 3) float32, m, and unit normal (n, 3) float32."""

    position: np.ndarray
    normal: np.ndarray

    def __len__(self) -> int:
        return len(self.position)


@dataclass(frozen=True)
class Splatted:
    """The light of photons at n points.

    Attributes
    ----------
    light : (n, 3) float32, W/m²
    stderr : (n,) float32, W/m²
        √(Σ (Φ κ)²) of the mean over colours, as of independent photons.
    radius : (n,) float32, m
        Of the splats that light comes from, on the average.
    """

    light: np.ndarray
    stderr: np.ndarray
    radius: np.ndarray


@by_reference
class Splats(NamedTuple):
    """Photons for kernels: position, unit normal (p, 3) float32, m, and radius (p,) float32, m."""

    position: np.ndarray
    normal: np.ndarray
    radius: np.ndarray


def splat_photons(
    points: LitPoints, photons: Photons, radius: np.ndarray, workers: Workers, response: Response | None = None
) -> Splatted:
    """Irradiance Σ Φ κ at points, or what `response` makes of it.

    Parameters
    ----------
    radius : (p,) float32, m
        Of the photons' splats.
    """
    sums = np.zeros((len(points), 5))
    if len(points) and len(photons):
        classes = _classes(radius)
        for turn, chosen in enumerate(classes):
            part = turn / len(classes), (turn + 1) / len(classes)
            _add_class(sums, points, photons, radius, chosen, workers, response, part)
    of_light = sums[:, 4] / np.maximum(sums[:, :3].mean(axis=1), 1e-30)
    return Splatted(sums[:, :3].astype(np.float32), np.sqrt(sums[:, 3]).astype(np.float32), of_light.astype(np.float32))


def _classes(radius: np.ndarray) -> list[np.ndarray]:
    """Indices of photons whose radii are alike, smallest first."""
    fold = np.floor(np.log(np.maximum(radius, 1e-30)) / np.log(_FOLD)).astype(int)
    return [np.flatnonzero(fold == one) for one in np.unique(fold)]


def _add_class(
    sums: np.ndarray,
    points: LitPoints,
    photons: Photons,
    radius: np.ndarray,
    chosen: np.ndarray,
    workers: Workers,
    response: Response | None,
    part: tuple[float, float],
) -> None:
    """Add to sums (n, 5) what the `chosen` photons bring."""
    rows, order = PointRows.of(points.position, float(radius[chosen].max()) / _ROWS_A_RADIUS)
    along_rows = np.argsort(rows.keys_of(photons.position[chosen]), kind="stable")
    chosen = chosen[along_rows]  # neighbours in a chunk light few rows
    position, normal = points.position[order], points.normal[order]

    def scatter(chunk: slice, _: np.random.Generator) -> tuple[slice, np.ndarray]:
        k = chosen[chunk]
        some = photons.where(k)
        splats = Splats(some.position, some.normal, radius[k])
        first, stop = _window(rows, splats)
        added = np.zeros((stop - first, 5))
        room = max(_PAIRS, stop - first)
        at, of, kernels = np.empty(room, np.int32), np.empty(room, np.int32), np.empty(room, np.float32)
        done = 0
        while done < len(k):
            workers.progress.check()
            done, n = find_pairs(rows, position, normal, splats, done, at, of, kernels)
            factor = np.ones((1, 1), np.float32) if response is None else response(order[at[:n]], k[of[:n]])
            add_pairs(at[:n], of[:n], kernels[:n], some.power, splats.radius, factor, first, added)
        return slice(first, stop), added

    chunks = workers.chunks(
        "Splatting photons", len(chosen), _CHUNK, scatter, (_SCATTERING,), part, row_bytes=_BYTES_A_PHOTON
    )
    of_rows = np.zeros_like(sums)
    for _, (window, added) in chunks:
        of_rows[window] += added
    sums[order] += of_rows


@kernel
def _window(rows, splats):
    """First and last but one of the points that splats may light."""
    first, stop = len(rows.keys), 0
    for p in range(len(splats.radius)):
        low, high = _steps_of_splat(rows, splats, p)
        first = min(first, first_from(rows.keys, key(low[0], low[1], low[2]), 0, len(rows.keys)))
        stop = max(stop, first_from(rows.keys, key(high[0] + 1, high[1], high[2]), 0, len(rows.keys)))
    return min(first, stop), stop


@part
def _steps_of_splat(rows, splats, p):
    return steps_of_box(rows, row(splats.position, p), row(splats.normal, p), splats.radius[p])


@part
def steps_of_box(rows, x, n, r):
    """Steps of the corners of the box around a photon's ellipsoid, half as long as √(r² (1 − n²) + (SLICE r)² n²)."""
    narrower = ONE - SLICE * SLICE
    half = (
        r * np.sqrt(ONE - narrower * n[0] * n[0]),
        r * np.sqrt(ONE - narrower * n[1] * n[1]),
        r * np.sqrt(ONE - narrower * n[2] * n[2]),
    )
    return steps(rows, minus(x, half)), steps(rows, plus(x, half))


@kernel
def find_pairs(rows, position, normal, splats, p, at, of, kernels):
    """Pairs of a point and a photon, of photons from the p-th on; the first that had no room, and how many pairs.

    Parameters
    ----------
    position, normal : (n, 3) float32, m
        Of the points, in the order of the rows.
    at, of : (m,) int32
        Become indices of points and photons, of as many as there are points at least.
    kernels : (m,) float32, 1/m²
        κ.
    """
    n = 0
    while p < len(splats.radius):
        found = _points_of_photon(rows, position, normal, splats, p, n, at, of, kernels)
        if found < 0:
            break
        p, n = p + 1, found
    return p, n


@part
def _points_of_photon(rows, position, normal, splats, p, n, at, of, kernels):
    """Add the points of one photon after the n-th pair: how many pairs there are then; −1 without room."""
    low, high = _steps_of_splat(rows, splats, p)
    x, facing, radius = row(splats.position, p), row(splats.normal, p), splats.radius[p]
    keys = rows.keys
    for z in range(low[2], high[2] + 1):
        start = first_from(keys, key(low[0], low[1], z), 0, len(keys))
        end = first_from(keys, key(high[0] + 1, high[1], z), start, len(keys))
        y = low[1]
        while start < end and y <= high[1]:
            stop = first_from(keys, key(high[0] + 1, y, z), start, end)
            for k in range(start, stop):
                kappa = splat_kernel(row(position, k), row(normal, k), x, facing, radius)
                if kappa > 0:
                    if n == len(at):
                        return -1
                    at[n], of[n], kernels[n] = k, p, kappa
                    n += 1
            y += 1
            start = first_from(keys, key(low[0], y, z), stop, end)
    return n


@part
def splat_kernel(position, normal, x, n, r):
    """κ at a point of a photon at x, on a surface of normal n (Eq. 3 with Epanechnikov's kernel), 1/m².

    It is 0 beyond the hull of its ellipsoid of radius r, and on another surface.
    """
    away, flat = minus(position, x), ONE / (r * r)
    height = dot(away, n)
    t2 = (dot(away, away) + _FLATNESS * height * height) * flat
    if t2 >= ONE or dot(normal, n) <= SAME_SIDE:
        return np.float32(0)
    return _PEAK * flat * (ONE - t2)


@kernel
def add_pairs(at, of, kernels, power, radius, factor, first, sums):
    """Add the light Φ κ of pairs, times `factor` (Eq. 1), to sums (w, 5) of the points from the `first` on.

    The sums are of three colours, and of their mean: of its square, and of its product with the splat's radius.

    Parameters
    ----------
    factor : (m, 1 or 3), or (1, 1), float32
        What points make of the irradiance.
    """
    last = factor.shape[1] - 1
    for k in range(len(at)):
        row_of = min(k, len(factor) - 1)
        kept = factor[row_of, 0], factor[row_of, min(1, last)], factor[row_of, last]
        light = mul(times(row(power, of[k]), kernels[k]), kept)
        to, brightness = sums[at[k] - first], mean(light)
        to[0] += light[0]
        to[1] += light[1]
        to[2] += light[2]
        to[3] += brightness * brightness
        to[4] += brightness * radius[of[k]]
