"""Light carried over links: from side to side of elements, bounce by bounce, and from there to vertices.

With D the direct and G the gathered light of sides (E/π), ρ what they reflect and τ what they let through of their
other side's, L = ρ (D + G) + τ (D' + G') is the radiance of a side, and G = F L + N what it gathers: the mean over its
links, and what near points make of direct light. Five products, and the tail of a geometric series, give what an edit
makes of it; more follow while nothing moves, until G stays as it is.
"""

import numpy as np

from ....core.compiling import kernel, part
from ....core.vec3 import BLACK, ONE, ZERO, mean, mul, plus, put, row, times
from ..crew import Crew, Task
from .links import INSIDE, RENEWED, STALE, Links
from .packing import unpacked
from .reflectance import Reflectance

_CHUNK = 1 << 10  # rows
N_PARTS = 4
"""Of a row's links, by whose means its error is known."""


@kernel
def _radiate(albedo, translucence, direct, gathered, start, stop, radiance):
    """L of sides; `start` and `stop` are even."""
    for side in range(start, stop):
        own = plus(row(direct, side), row(gathered, side))
        other = plus(row(direct, side ^ 1), row(gathered, side ^ 1))
        put(radiance, side, plus(mul(row(albedo, side), own), mul(row(translucence, side), other)))


@part
def _light_of_link(links, radiance, i, k):
    """What comes over a link."""
    side = links.end[i, k]
    if side < 0:
        return BLACK
    return mul(row(radiance, side), unpacked(links.weight[i, k]))


@part
def _mean_of_links(links, radiance, i, first, last):
    """Mean over links `first` to `last` of a row, and the number that counts."""
    total, n = BLACK, 0
    for k in range(first, last):
        total = plus(total, _light_of_link(links, radiance, i, k))
        n += links.end[i, k] != INSIDE
    return times(total, ONE / np.float32(max(n, 1))), n


@part
def _mean_of_strata(links, radiance, i, n_links):
    """Mean over the first N links of a row of which S are stale, or were.

    The k of those that are renewed stand for all of them, (Σ_kept L + S/k Σ_renewed L) / N; until one of these is not
    what it was, they stand as they were.
    """
    kept = stale = renewed = BLACK
    n_kept = n_stale = n_renewed = 0
    for k in range(n_links):
        light, counts = _light_of_link(links, radiance, i, k), links.end[i, k] != INSIDE
        if links.state[i, k] == STALE:
            stale, n_stale = plus(stale, light), n_stale + counts
        elif links.state[i, k] == RENEWED:
            renewed, n_renewed = plus(renewed, light), n_renewed + counts
        else:
            kept, n_kept = plus(kept, light), n_kept + counts
    n = n_kept + n_stale + n_renewed
    if n_renewed == 0 or not links.changed[i]:
        return times(plus(plus(kept, stale), renewed), ONE / np.float32(max(n, 1)))
    share = np.float32(n_stale + n_renewed) / np.float32(n_renewed)
    return times(plus(kept, times(renewed, share)), ONE / np.float32(max(n, 1)))


@kernel
def _gather_sides(links, n_links, radiance, sides, start, stop, gathered):
    for i in range(start, stop):
        side = sides[i]
        if links.split[side]:
            put(gathered, side, _mean_of_strata(links, radiance, side, n_links))
        else:
            put(gathered, side, _mean_of_links(links, radiance, side, 0, n_links)[0])


@kernel
def _gather_vertices(links, n_links, radiance, start, stop, gathered, variance):
    """What vertices gather, and the variance of its mean over colours by that of parts of their links."""
    for i in range(start, stop):
        total, n, sum_1, sum_2 = BLACK, 0, ZERO, ZERO
        for p in range(N_PARTS):
            light, count = _mean_of_links(links, radiance, i, p * n_links // N_PARTS, (p + 1) * n_links // N_PARTS)
            total, n = plus(total, times(light, np.float32(count))), n + count
            sum_1, sum_2 = sum_1 + mean(light), sum_2 + mean(light) * mean(light)
        if links.split[i]:
            put(gathered, i, _mean_of_strata(links, radiance, i, n_links))
        else:
            put(gathered, i, times(total, ONE / np.float32(max(n, 1))))
        spread = sum_2 / np.float32(N_PARTS) - (sum_1 / np.float32(N_PARTS)) ** 2
        variance[i] = max(spread, ZERO) / np.float32(N_PARTS - 1)


class Transport:
    """Radiance of the sides of elements, which bounces between them.

    Attributes
    ----------
    gathered : (s, 3) float32, W/(m² sr)
        G.
    radiance : (s, 3) float32, W/(m² sr)
        L.
    """

    def __init__(self, n_sides: int, crew: Crew) -> None:
        self._crew = crew
        self.gathered, self.radiance = np.zeros((2, n_sides, 3), np.float32)

    def bounce(self, direct: np.ndarray, near: np.ndarray, links: Links, sides: np.ndarray, of: Reflectance) -> float:
        """Once from side to side; how much G changed, relative to it."""
        self.radiate(direct, of)
        gathered = np.zeros_like(self.gathered)

        def gather(chunk: slice) -> None:
            at = sides, chunk.start, chunk.stop
            _gather_sides(links.arrays, links.n_traced, self.radiance, *at, gathered)

        self._crew.run(Task(len(sides)), _CHUNK, gather)
        gathered += near
        change = float(np.abs(gathered - self.gathered).sum(dtype=np.float64))
        self.gathered = gathered
        return change / max(float(np.abs(gathered).sum(dtype=np.float64)), 1e-30)

    def restart(
        self, n: int, direct: np.ndarray, near: np.ndarray, links: Links, sides: np.ndarray, of: Reflectance
    ) -> None:
        """N bounces of new direct light, and what those after them add if each is the same share of the one before."""
        before = np.zeros(3)
        self.gathered = np.zeros_like(self.gathered)
        for _ in range(max(n, 1)):
            last, was = before, self.gathered
            self.bounce(direct, near, links, sides, of)
            added = self.gathered - was
            before = np.abs(added).sum(axis=0, dtype=np.float64)
        share = np.clip(before / np.maximum(last, 1e-30), 0, _LARGEST_SHARE) if n > 1 else np.zeros(3)
        self.gathered += added * (share / (1 - share)).astype(np.float32)

    def radiate(self, direct: np.ndarray, of: Reflectance) -> None:
        """L of D and G."""

        def radiate(chunk: slice) -> None:
            at = chunk.start, chunk.stop, self.radiance
            _radiate(of.albedo, of.translucence, direct, self.gathered, *at)

        self._crew.run(Task(len(self.radiance)), 1 << 14, radiate)

    def to_vertices(self, links: Links, n_links: int, gathered: np.ndarray, variance: np.ndarray) -> None:
        """What vertices gather of L by their first links, (n, 3), and its variance, (n,); of the mean over colours."""

        def gather(chunk: slice) -> None:
            at = chunk.start, chunk.stop, gathered, variance
            _gather_vertices(links.arrays, n_links, self.radiance, *at)

        self._crew.run(Task(len(gathered)), _CHUNK, gather)


_LARGEST_SHARE = 0.95
