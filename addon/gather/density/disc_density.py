"""Density estimate in mid-air: the irradiance at receivers on objects that no light stops at.

Where photons fly through an object, none is stored on it. There their flights are counted that cross the receiver's
tangent disc (Lastra, Ureña, Revelles and Montes 2002), as many of the nearest as the estimate on surfaces takes.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...core.parallel import Workers, slices
from ...core.sampling.vectors import dot, largest, rows
from ...core.sampling.warps import frame
from ...core.z_curve import z_curve
from ...emitters import Sphere
from ...photons import FlightLog, Flights, PathKind
from ...receivers import Receivers
from ...scene import Scene
from ...tracing import Tracer, TransparencyTracer
from ..irradiance import Estimate
from .density import LEAST_ESTIMATES, LEAST_SHARE, LOW_DENSITY, estimate_of, points_of_discs

_OFF_SURFACE = np.float32(0.1)
"""How far receivers may be off their surface, over their footprint: lift and pull take them a third as far at most."""

_ROUNDING = np.float32(2**-16)  # of a coordinate, over itself, and more
_AROUND = 8  # directions in which surfaces are looked for, beside the one down
_LEAST_MARGIN = 0.05  # of the ball beyond the receivers, over the scene's diagonal
_DISCS = 42  # stream of random numbers
_TOGETHER, _FEW = 1024, 32  # receivers that lie together, for which flights are chosen; and of these some once more
_FIRST_LOOK, _MOST_LOOKS = 4, 64  # flights that are looked at first, and at most, over those that an estimate takes
_PAIRS = 1 << 18  # of receivers and flights together, which bounds the memory


@dataclass(frozen=True)
class MidAir:
    """The receivers that lie on no surface that photons stop at, and the flights past them.

    Attributes
    ----------
    rows : (m,) int
        Which of the receivers they are.
    log : FlightLog
        For `trace_photons`.
    """

    rows: np.ndarray
    log: FlightLog
    _tracer: Tracer

    @staticmethod
    def of(scene: Scene, tracer: TransparencyTracer, receivers: Receivers, scattered: bool) -> "MidAir | None":
        """Those among receivers, None without any; caustics alone are theirs unless all `scattered` light is wanted."""
        free = _off_surfaces(tracer.surfaces, receivers)
        if receivers.takes_caustics is not None and not scattered:
            free &= receivers.takes_caustics
        if not free.any():
            return None
        ball = _ball_around(receivers.position[free], _LEAST_MARGIN * scene.diagonal)
        return MidAir(np.flatnonzero(free), FlightLog(ball, scattered), tracer.surfaces)

    def of_first(self, n: int) -> "MidAir":
        """The same of the first n receivers alone."""
        return replace(self, rows=self.rows[self.rows < n])

    def put(
        self,
        light: Estimate,
        receivers: Receivers,
        max_radius: float,
        n_nearest: int,
        kind: PathKind | None,
        workers: Workers,
    ) -> Estimate:
        """Light of all receivers, with the estimates in mid-air put in their places.

        Parameters
        ----------
        max_radius : float, m
            Of discs; 0 finds it from the flights' density.
        n_nearest : int
            Flights that an estimate looks for.
        kind : PathKind or None
            Of the photons that count; None for all.
        """
        rows, flights = self.rows, self.log.flights()
        if kind is not None:
            flights = flights.where(flights.specular == (kind == PathKind.CAUSTIC))
        if kind == PathKind.CAUSTIC and receivers.takes_caustics is not None:
            rows = rows[receivers.takes_caustics[rows]]
        if len(flights) < LEAST_ESTIMATES * n_nearest:
            light.put(rows, Estimate.dark(len(rows), receivers.directional))
        elif len(rows):
            density = DiscDensity(self._tracer, flights, self.log.ball, n_nearest, max_radius)
            light.put(rows, density.at(receivers.where(rows), workers))
        return light


def _off_surfaces(tracer: Tracer, receivers: Receivers) -> np.ndarray:
    """Which receivers have no surface close beneath them, nor beside: at a tip none may be beneath; (n,) bool."""
    reach = _OFF_SURFACE * receivers.footprint + _ROUNDING * largest(np.abs(receivers.position))
    above = receivers.position + reach[:, None] * receivers.normal
    free = ~tracer.closest_hit(above, -receivers.normal, 2 * reach).hit
    for angle in np.arange(_AROUND) * (2 * np.pi / _AROUND):
        k = np.flatnonzero(free)
        tangent, bitangent = frame(rows(receivers.normal, k))
        aside = np.float32(np.cos(angle)) * tangent + np.float32(np.sin(angle)) * bitangent
        way = (aside - rows(receivers.normal, k)) / np.float32(2**0.5)
        for start in (receivers.position, above):
            free[k] &= ~tracer.closest_hit(rows(start, k), way, 2 * reach[k]).hit
    return free


def _ball_around(positions: np.ndarray, margin: float) -> Sphere:
    """A ball with room for discs around at least one position (n, 3), wider than a margin, m."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    radius = float(np.linalg.norm(high - low)) / 2
    return Sphere((low + high) / 2, radius + max(radius, margin))


class DiscDensity:
    """Tells the irradiance from the flights through receivers' tangent discs: E = Σ Φ / (s π r²), as `PhotonDensity`.

    s is the share of the disc that the receiver sees.

    Parameters
    ----------
    flights : Flights
        Through `ball`, which is around the receivers.
    n_nearest : int
        k.
    r_max : float, m
        Radius of the largest disc, if the ball has room for it; 0 finds it from the flights' density.
    """

    def __init__(self, tracer: Tracer, flights: Flights, ball: Sphere, n_nearest: int, r_max: float) -> None:
        self._tracer, self._flights, self._ball, self._k = tracer, flights, ball, n_nearest
        by_density = ball.radius * np.sqrt(n_nearest / (LOW_DENSITY * max(len(flights), 1)))
        self._r_max = float(r_max or by_density)

    def at(self, receivers: Receivers, workers: Workers) -> Estimate:
        """Estimates at n receivers, at least one."""
        estimates = Estimate.dark(len(receivers), receivers.directional)
        away = receivers.position - self._ball.centre
        r_max = min(self._r_max, self._ball.radius - float(np.sqrt(dot(away, away).max())))
        order = np.argsort(z_curve(receivers.position), kind="stable")

        def estimate(chunk: slice, _: np.random.Generator) -> list[tuple[np.ndarray, Estimate]]:
            k = order[chunk]
            flights = self._flights.where(_within(self._flights, receivers.position[k], r_max))
            few = [k[part] for part in slices(len(k), _FEW)]
            return [(part, self._estimate(receivers.where(part), flights, r_max)) for part in few]

        for _, parts in workers.chunks("Gathering photons", len(order), _TOGETHER, estimate, (_DISCS,)):
            for part, found in parts:
                estimates.put(part, found)
        return estimates

    def _estimate(self, receivers: Receivers, flights: Flights, r_max: float) -> Estimate:
        """Estimates at a few receivers that lie together."""
        x, normals = receivers.position, receivers.normal
        nearest, r = _nearest(flights, x, normals, self._k, r_max)
        share, hidden = self._seen_share(x, normals, r)
        k, j = np.nonzero((nearest >= 0) & hidden[:, None])
        covered = self._tracer.occluded(rows(x, k), _crossings(flights.where(nearest[k, j]), rows(x, k), normals[k]))
        nearest[k[covered], j[covered]] = -1
        area = np.maximum(np.pi * r**2 * share, np.float32(1e-30))
        return estimate_of(nearest, flights.power, flights.direction if receivers.directional else None, normals, area)

    def _seen_share(self, x: np.ndarray, normals: np.ndarray, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Share of each disc that its middle sees, (n,) float32; and whether something hides a part, (n,) bool."""
        ends = points_of_discs(x, normals, r).astype(np.float32)
        n_rays = ends.shape[1]
        hidden = self._tracer.occluded(np.repeat(x, n_rays, 0), ends.reshape(-1, 3)).reshape(len(x), n_rays)
        return np.maximum((~hidden).mean(axis=1, dtype=np.float32), LEAST_SHARE), hidden.any(axis=1)


def _within(flights: Flights, x: np.ndarray, r: float) -> np.ndarray:
    """Which flights come within a distance of any of the ball around points (n, 3), (k,) int."""
    middle, reach = _ball(x)
    return np.flatnonzero(_distance(flights, middle) <= reach + r)


def _ball(x: np.ndarray) -> tuple[np.ndarray, float]:
    """Middle and radius of a ball around points (n, 3)."""
    middle = ((x.min(axis=0) + x.max(axis=0)) / 2).astype(np.float32)
    return middle, float(np.sqrt(dot(x - middle, x - middle).max()))


def _distance(flights: Flights, point: np.ndarray) -> np.ndarray:
    """Of flights from a point, (f,) float32, m."""
    way = point - flights.origin
    t = np.clip(dot(way, flights.direction), 0, flights.length)
    way -= t[:, None] * flights.direction
    return np.sqrt(dot(way, way))


def _nearest(
    flights: Flights, x: np.ndarray, normals: np.ndarray, k: int, r_max: float
) -> tuple[np.ndarray, np.ndarray]:
    """The k − 1 flights nearest to each receiver that cross its disc from the front, (n, k − 1) int, −1 for none.

    Also the disc's radius (n,) float32, m: the k-th's distance; `r_max` if there are fewer, or less where so few of
    very many flights cross the disc that the rest is not looked at.
    """
    nearest, radius = np.full((len(x), k - 1), -1), np.full(len(x), r_max, np.float32)
    middle, spread = _ball(x)
    faced = np.flatnonzero(_faced(flights, normals))
    away, n_first = _distance(flights.where(faced), middle), _FIRST_LOOK * k
    # Flights through a small ball are enough, unless too few cross the discs
    looked = np.partition(away, n_first)[n_first] if len(away) > n_first else np.inf
    left = np.arange(len(x))
    while len(left):
        reach = min(looked, r_max)
        near = faced[away <= reach + spread]
        for some in np.array_split(left, 1 + len(left) * len(near) // _PAIRS):
            distance = _distances(flights.where(near), x[some] - middle, normals[some], middle)
            if len(near) < k:
                distance = np.pad(distance, ((0, 0), (0, k - len(near))), constant_values=np.inf)
            chosen = np.argpartition(distance, k - 1, axis=1)[:, :k]  # the k-th comes last
            distance = np.take_along_axis(distance, chosen, 1)
            radius[some] = np.minimum(distance[:, -1], reach)
            i, j = np.nonzero(distance[:, :-1] < radius[some, None])
            nearest[some] = -1
            nearest[some[i], j] = near[chosen[i, j]]
        if reach == r_max or (reach > spread and len(near) > _MOST_LOOKS * k):
            break
        left = left[radius[left] == np.float32(reach)]
        looked *= 2
    return nearest, radius


def _faced(flights: Flights, normals: np.ndarray) -> np.ndarray:
    """Which flights may come to the front of any of the receivers, (f,) bool."""
    middle = normals.mean(axis=0)
    middle /= np.maximum(np.linalg.norm(middle), np.float32(1e-9))
    cosine = max(float((normals @ middle).min()), 0.0)
    faced: np.ndarray = flights.direction @ middle < np.sqrt(max(1 - cosine**2, 0)) + 1e-3
    return faced


def _distances(flights: Flights, x: np.ndarray, normals: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """How far from receivers flights cross their planes from the front, (n, f) float64, m; infinite if they do not.

    Parameters
    ----------
    x : (n, 3) float32, m
        The receivers, from `middle`.
    """
    origin, direction = (flights.origin - middle).astype(np.float64), flights.direction.astype(np.float64)
    x, normals = x.astype(np.float64), normals.astype(np.float64)
    fall = normals @ direction.T
    t = (normals @ origin.T - dot(normals, x)[:, None]) / np.maximum(-fall, 1e-9)
    along = dot(origin, direction) - x @ direction.T
    squared = (
        dot(origin, origin) - 2 * (x @ origin.T) + dot(x, x)[:, None] + t * (2 * along + t * dot(direction, direction))
    )
    crosses = (fall < 0) & (t >= 0) & (t <= flights.length)
    return np.where(crosses, np.sqrt(np.maximum(squared, 0)), np.inf)


def _crossings(flights: Flights, x: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Where flights cross the planes of as many receivers, (n, 3) float32, m."""
    t = dot(x - flights.origin, normals) / dot(flights.direction, normals)
    return flights.origin + t[:, None] * flights.direction
