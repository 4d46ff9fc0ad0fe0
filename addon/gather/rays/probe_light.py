"""Light that comes to points in the air from all around: radiance as spherical harmonics, irradiance of six sides.

Where the radiance L(ω) comes from the directions ω, a probe holds

    c = ∫ L(ω) y(ω) dω,        E(a) = ∫ L(ω) (ω·a)⁺ dω    for the sides a = ±x, ±y, ±z,

which are all of one kind: ∫ L k dω with a kernel k(ω) of as many rows. Gather rays in uniform directions, points of
Fibonacci's spiral turned at random, estimate them by 4π times the mean of L k.

Direct light comes as estimates of the irradiance of the six sides, each by light from one direction. Since the squares
of (ω·a)⁺ add up to 1 over the sides, ∫ L k dω = Σ_a ∫ L (ω·a)⁺ · (ω·a)⁺ k(ω) dω: each estimate counts with
(ω·a)⁺ k(ω), so that a small lamp's light is exact. What is left to cosine-weighted rays counts with the squares.

Caustics are what photons carry through a ball around the probe, whose cross-section is π r²: Σ Φ k(−Θ) / (π r²).
"""

from dataclasses import dataclass, replace

import numpy as np

from ...core.parallel import Workers
from ...core.sampling.spherical_harmonics import sh_basis
from ...core.sampling.vectors import dot
from ...photons import Flights
from ...tracing import Hits
from ..direct.direct_light import DirectLight
from .gather_rays import GatherRays

STAGE = "Lighting probes"

SIDES = np.concatenate([np.eye(3), -np.eye(3)])[[0, 3, 1, 4, 2, 5]].astype(np.float32)
"""The six sides, +x, −x, +y, −y, +z, −z."""

N_BANDS = 3
N_SH = N_BANDS**2

N_BATCHES = 8
"""Estimates of each probe that are independent of each other, whose spread tells the error."""

N_DIRECT = 4
"""Estimates of direct light of each side, in each batch."""

MOSTLY_BACKS, DARK = 0.5, 0.01
"""Share of surfaces' backs in what a probe inside of a solid sees at least; its light over the mean, at most."""

_CHUNK = 1 << 16  # rays
_RAYS, _CAUSTICS = 95, 96  # streams of random numbers
_MOST_FLIGHTS = 1 << 18
_PAIRS = 1 << 21  # of probes and flights together, which bounds the memory
_GOLDEN_ANGLE = np.pi * (3 - 5**0.5)


@dataclass(frozen=True)
class ProbeLight:
    """Light at n probes.

    Attributes
    ----------
    sh : (n, 9, 3) float32, W/m²
        Of the radiance, in the order of `sh_basis`: times the basis functions W/(m² sr).
    irradiance : (n, 6, 3) float32, W/m²
        Of `SIDES`.
    stderr : (n, 15) float32, W/m²
        Estimated standard errors of these 9 and 6, of their means over colours.
    backs : (n,) float32
        Of the rays that ended on surfaces, the share that ended on their backs.
    """

    sh: np.ndarray
    irradiance: np.ndarray
    stderr: np.ndarray
    backs: np.ndarray

    @property
    def inside(self) -> np.ndarray:
        """Which probes lie inside of solids, (n,) bool: they see backs of surfaces, and next to no light."""
        light = np.abs(self.irradiance).mean(axis=(1, 2), dtype=np.float64)
        return (self.backs >= MOSTLY_BACKS) & (light <= DARK * light.mean())

    @property
    def relative_noise(self) -> float:
        """Root mean square of the irradiance's standard errors over its mean; 0 where all is dark."""
        mean = float(self.irradiance.mean(dtype=np.float64)) if self.irradiance.size else 0.0
        return float(np.sqrt(np.mean(self.stderr[:, N_SH:].astype(np.float64) ** 2))) / mean if mean > 0 else 0.0

    def plus(self, other: "ProbeLight") -> "ProbeLight":
        """The sum of two kinds of light, whose errors are independent."""
        stderr = np.hypot(self.stderr, other.stderr)
        return ProbeLight(self.sh + other.sh, self.irradiance + other.irradiance, stderr, self.backs)

    def over(self, n: int) -> "ProbeLight":
        """The mean of n lights, of their sum."""
        share = np.float32(1 / n)
        return replace(self, sh=share * self.sh, irradiance=share * self.irradiance, stderr=share * self.stderr)

    def with_noise(self, noise: float) -> "ProbeLight":
        """The same light, whose mean irradiance has an error besides, W/m²: each probe's in proportion to its light."""
        light = np.abs(self.irradiance).mean(axis=(1, 2), dtype=np.float64)
        share = light / light.mean() if light.any() else np.ones_like(light)
        # Light of irradiance E from everywhere has c = 2E/√π, and no other coefficient can be larger
        most = np.concatenate([np.full(N_SH, 2 / np.sqrt(np.pi)), np.ones(len(SIDES))])
        stderr = np.hypot(self.stderr, noise * share[:, None] * most).astype(np.float32)
        return replace(self, stderr=stderr)


def kernel(directions: np.ndarray) -> np.ndarray:
    """k(ω) of unit directions (n, 3): 9 basis functions and the clamped cosines of 6 sides, (n, 15) float32."""
    return np.concatenate([sh_basis(directions, N_BANDS), np.maximum(directions @ SIDES.T, 0)], axis=1)


def gather_probes(
    rays: GatherRays,
    direct: DirectLight | None,
    positions: np.ndarray,
    n_rays: int,
    workers: Workers,
) -> ProbeLight:
    """Light at positions (n, 3), without caustics; direct light with it where it is given.

    Parameters
    ----------
    n_rays : int
        Of each probe, at least `N_BATCHES`.
    """
    k, n = max(1, n_rays // N_BATCHES), len(positions)
    sums, stderr = np.zeros((n, N_SH + len(SIDES), 3), np.float32), np.zeros((n, N_SH + len(SIDES)), np.float32)
    backs = np.zeros(n, np.float32)

    def gather(chunk: slice, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        at = positions[chunk]
        directions = sphere_directions(len(at) * N_BATCHES, k, random)
        origins = np.repeat(at, N_BATCHES * k, 0)
        met = rays.radiance_along(origins, directions, random)
        radiance = met.reflected
        if direct is not None:
            radiance = radiance + direct.met(rays.tracer.dimmed(met.hits, origins, directions), directions, SIDES)
        light = _sums(np.float32(4 * np.pi / k) * radiance, directions, len(at))
        if direct is not None:
            light += _direct_sampled(direct, at, random)
        spread = light.mean(axis=3).std(axis=1, ddof=1) / np.float32(N_BATCHES**0.5)
        return light.mean(axis=1), spread, _share_of_backs(met.hits, directions, len(at))

    size = max(1, _CHUNK // (k * N_BATCHES))
    for chunk, result in workers.chunks(STAGE, n, size, gather, (_RAYS,)):
        sums[chunk], stderr[chunk], backs[chunk] = result
    return ProbeLight(sums[:, :N_SH], sums[:, N_SH:], stderr, backs)


def _sums(light: np.ndarray, directions: np.ndarray, n: int) -> np.ndarray:
    """Sums of light (r, 3) from directions (r, 3) times the kernel over batches of n probes, (n, N_BATCHES, 15, 3)."""
    k = kernel(directions).reshape(n, N_BATCHES, -1, N_SH + len(SIDES))
    sums: np.ndarray = k.swapaxes(2, 3) @ light.reshape(n, N_BATCHES, -1, 3)
    return sums


def _direct_sampled(direct: DirectLight, positions: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Direct light that is sampled from each of n positions, in batches, (n, N_BATCHES, 15, 3)."""
    n = len(positions)
    at = np.repeat(positions, N_BATCHES * len(SIDES) * N_DIRECT, axis=0)
    sides = np.tile(np.repeat(SIDES, N_DIRECT, axis=0), (n * N_BATCHES, 1))
    found = direct.sample(at, sides, None, random)
    share = np.maximum(dot(found.direction, sides), 0) / np.float32(N_DIRECT)
    return _sums(share[:, None] * found.irradiance, found.direction, n)


def _share_of_backs(hits: Hits, directions: np.ndarray, n: int) -> np.ndarray:
    """Of each of n probes' rays that ended on surfaces the share that ended on their backs, (n,) float32."""
    hit = hits.hit.reshape(n, -1)
    back = hits.back(directions).reshape(n, -1) & hit
    return (back.sum(axis=1) / np.maximum(hit.sum(axis=1), 1)).astype(np.float32)


def caustics_at_probes(flights: Flights, positions: np.ndarray, n_nearest: int, workers: Workers) -> ProbeLight:
    """Light at positions (n, 3) by the flights nearest to each."""
    n, rows = len(positions), N_SH + len(SIDES)
    sums, stderr = np.zeros((n, rows, 3), np.float32), np.zeros((n, rows), np.float32)
    flights, scale = _thinned(flights)
    n_nearest = min(n_nearest, len(flights) - 1)

    def estimate(chunk: slice, _: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        squared = _squared_distances(flights, positions[chunk])
        nearest = np.argpartition(squared, n_nearest, axis=1)[:, : n_nearest + 1]
        area = np.pi * np.take_along_axis(squared, nearest[:, -1:], 1)  # the ball's, which the last one touches
        near = nearest[:, :-1].ravel()
        power = flights.power[near].reshape(-1, n_nearest, 3) * np.float32(scale)
        k = kernel(-flights.direction[near]).reshape(-1, n_nearest, rows)
        noise = np.sqrt(np.einsum("nkw,nk->nw", k * k, power.mean(axis=2) ** 2))
        return k.swapaxes(1, 2) @ power / area[..., None], noise / area

    size = max(1, _PAIRS // max(len(flights), 1))
    for chunk, result in workers.chunks(STAGE, n if n_nearest > 0 else 0, size, estimate, (_CAUSTICS,)):
        sums[chunk], stderr[chunk] = result
    return ProbeLight(sums[:, :N_SH], sums[:, N_SH:], stderr, np.zeros(n, np.float32))


def _thinned(flights: Flights) -> tuple[Flights, float]:
    """At most about `_MOST_FLIGHTS`, and how many times their power they stand for."""
    step = 1 + len(flights) // _MOST_FLIGHTS
    few = flights.where(np.arange(0, len(flights), step))
    return few, len(flights) / max(len(few), 1)


def _squared_distances(flights: Flights, positions: np.ndarray) -> np.ndarray:
    """Of positions (n, 3) from flights, (n, f) float64, m²."""
    middle = positions.mean(axis=0)
    x, origin = (positions - middle).astype(np.float64), (flights.origin - middle).astype(np.float64)
    direction = flights.direction.astype(np.float64)
    along = x @ direction.T - dot(origin, direction)
    t = np.clip(along, 0, flights.length)
    squared = dot(x, x)[:, None] + dot(origin, origin) - 2 * (x @ origin.T) + t * (t - 2 * along)
    return np.maximum(squared, 1e-12)


def sphere_directions(n_runs: int, n_rays: int, random: np.random.Generator) -> np.ndarray:
    """Uniform directions, (n_runs · n_rays, 3) float32: in each run Fibonacci's spiral, turned at random."""
    i = np.arange(n_rays)
    z = 1 - (2 * i + 1) / n_rays
    r, phi = np.sqrt(1 - z * z), i * _GOLDEN_ANGLE
    spiral = np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1).astype(np.float32)
    turned: np.ndarray = (spiral @ _rotations(n_runs, random)).reshape(-1, 3)
    return turned / np.sqrt(dot(turned, turned))[:, None]


def _rotations(n: int, random: np.random.Generator) -> np.ndarray:
    """Uniformly random rotations, (n, 3, 3) float32, by unit quaternions."""
    q = random.standard_normal((n, 4)).astype(np.float32)
    w, x, y, z = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
    rotations = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rotations, np.float32).transpose(2, 0, 1)
