"""Light carried over links: from side to side of elements, bounce by bounce, and from there to vertices.

With D the direct and G the gathered light of sides (E/π), ρ what they reflect and τ what they let through of their
other side's, L = ρ (D + G) + τ (D' + G') is the radiance of a side, and G = F L + N what it gathers: the mean over its
links, and what near points make of direct light. A few products, and the tail of a geometric series, give what an edit
makes of it; more follow while nothing moves, until G stays as it is.

The products of the first light after an edit go on from the G of before, and over the first links of each row alone.
What those gather is multiplied by the ratio of what all links of the row gathered before the edit to what the first
did: the ratio estimator of sampling theory. Light that an edit does not change stays exactly as it was, and light that
becomes brighter or darker as a whole is as well known as before.
"""

import numpy as np

from ....core.compiling import kernel, part
from ....core.vec3 import BLACK, ONE, ZERO, mean, minus, mul, plus, put, row, times
from ..crew import Crew, Task
from .links import INSIDE, N_PARTS, RENEWED, Links, is_stale
from .packing import unpacked
from .reflectance import Reflectance

_CHUNK = 1 << 18  # links
_LEAST_RATIO, _MOST_RATIO = np.float32(0.25), np.float32(4)
_LARGEST_SHARE = 0.95


@kernel
def _radiate(albedo, translucence, direct, gathered, start, stop, radiance):
    """L of sides; `start` and `stop` are even."""
    for side in range(start, stop):
        own = plus(row(direct, side), row(gathered, side))
        other = plus(row(direct, side ^ 1), row(gathered, side ^ 1))
        put(radiance, side, plus(mul(row(albedo, side), own), mul(row(translucence, side), other)))


@part
def _light_over(radiance, side, weight):
    """What comes over a link from where it ends."""
    if side < 0:
        return BLACK
    return mul(row(radiance, side), unpacked(weight))


@part
def _sum_of_links(links, radiance, i, first, last):
    """Sum over links `first` to `last` of a row, and the number that counts."""
    total, n = BLACK, 0
    for k in range(first, last):
        total = plus(total, _light_over(radiance, links.end[i, k], links.weight[i, k]))
        n += links.end[i, k] != INSIDE
    return total, n


@part
def _over(total, n):
    return times(total, ONE / np.float32(max(n, 1)))


@part
def _mean_of_strata(links, radiance, i, n_links):
    """Mean over the first N links of a row of which S are stale, or were; k of these are renewed.

    These stand for all of them. If few of the k are not what they were before, they say how far the S are off,
    (Σ_kept L + Σ_S L_before + S/k Σ_renewed (L − L_before)) / N: dragged slowly, an object leaves most of what it
    crosses as it is. Otherwise, (Σ_kept L + S/k Σ_renewed L) / N. Until one is not what it was, all stand as they were.
    """
    kept = stale = renewed = before = BLACK
    n_kept = n_stale = n_renewed = n_known = n_other = 0
    for k in range(n_links):
        light, counts = _light_over(radiance, links.end[i, k], links.weight[i, k]), links.end[i, k] != INSIDE
        if is_stale(links, i, k):
            stale, n_stale = plus(stale, light), n_stale + counts
        elif links.state[i, k] == RENEWED:
            renewed, n_renewed = plus(renewed, light), n_renewed + counts
            if k < links.end_before.shape[1] and counts and links.end_before[i, k] != INSIDE:
                before = plus(before, _light_over(radiance, links.end_before[i, k], links.weight_before[i, k]))
                n_known, n_other = n_known + 1, n_other + (links.end_before[i, k] != links.end[i, k])
        else:
            kept, n_kept = plus(kept, light), n_kept + counts
    n = n_kept + n_stale + n_renewed
    if n_renewed == 0 or not links.changed[i]:
        return _over(plus(plus(kept, stale), renewed), n)
    share = np.float32(n_stale + n_renewed) / np.float32(n_renewed)
    if n_known < n_renewed or 2 * n_other > n_renewed:
        return _over(plus(kept, times(renewed, share)), n)
    of_all = plus(plus(plus(kept, stale), before), times(minus(renewed, before), share))
    return _over((max(of_all[0], ZERO), max(of_all[1], ZERO), max(of_all[2], ZERO)), n)


@part
def _ratio(every, first):
    return min(max(every / first, _LEAST_RATIO), _MOST_RATIO) if first > ZERO else ONE


@part
def _put_gathered(gathered, ratio, i, first, every, whole):
    """Write what a row gathers by the mean of its first links and, if that is known anew, by that of all."""
    if whole:
        put(ratio, i, (_ratio(every[0], first[0]), _ratio(every[1], first[1]), _ratio(every[2], first[2])))
        put(gathered, i, every)
    else:
        put(gathered, i, mul(first, row(ratio, i)))


@kernel
def _gather_sides(links, n_first, n_links, whole, radiance, sides, start, stop, gathered, ratio):
    """What `sides` from `start` to `stop` gather."""
    for i in range(start, stop):
        side = sides[i]
        if links.split[side]:
            first = _mean_of_strata(links, radiance, side, n_first)
            every = _mean_of_strata(links, radiance, side, n_links) if whole else first
        else:
            total, n = _sum_of_links(links, radiance, side, 0, n_first)
            first = every = _over(total, n)
            if whole:
                rest, n_rest = _sum_of_links(links, radiance, side, n_first, n_links)
                every = _over(plus(total, rest), n + n_rest)
        _put_gathered(gathered, ratio, side, first, every, whole)


@kernel
def _gather_vertices(links, n_first, n_links, whole, radiance, start, stop, gathered, ratio, variance):
    """What vertices gather, and the variance of its mean over colours by that of parts of their links."""
    n_used = n_links if whole else n_first
    for i in range(start, stop):
        total, n, sum_1, sum_2, first = BLACK, 0, ZERO, ZERO, BLACK
        for p in range(N_PARTS):
            light, count = _sum_of_links(links, radiance, i, p * n_used // N_PARTS, (p + 1) * n_used // N_PARTS)
            of_part = _over(light, count)
            first = of_part if p == 0 else first
            total, n = plus(total, light), n + count
            sum_1, sum_2 = sum_1 + mean(of_part), sum_2 + mean(of_part) * mean(of_part)
        every = _over(total, n)
        if links.split[i]:
            every = _mean_of_strata(links, radiance, i, n_used)
            first = _mean_of_strata(links, radiance, i, n_first) if whole else every
        _put_gathered(gathered, ratio, i, first if whole else every, every, whole)
        spread = sum_2 / np.float32(N_PARTS) - (sum_1 / np.float32(N_PARTS)) ** 2
        variance[i] = max(spread, ZERO) / np.float32(N_PARTS - 1)


class Transport:
    """Radiance of the sides of elements, which bounces between them, and what vertices gather of it.

    Attributes
    ----------
    gathered : (s, 3) float32, W/(m² sr)
        G.
    radiance : (s, 3) float32, W/(m² sr)
        L.
    """

    def __init__(self, n_sides: int, n_vertices: int, crew: Crew) -> None:
        self._crew = crew
        self.gathered, self.radiance = np.zeros((2, n_sides, 3), np.float32)
        self._ratio_of_sides, self._ratio_of_vertices = (np.ones((n, 3), np.float32) for n in (n_sides, n_vertices))

    def bounce(
        self, direct: np.ndarray, near: np.ndarray, links: Links, sides: np.ndarray, of: Reflectance, whole: bool = True
    ) -> float:
        """Once from side to side, over all links or over the first; how much G changed, relative to it."""
        self.radiate(direct, of)
        gathered = np.zeros_like(self.gathered)

        def gather(chunk: slice) -> None:
            at = self.radiance, sides, chunk.start, chunk.stop, gathered, self._ratio_of_sides
            _gather_sides(links.arrays, links.n_first, links.n_traced, whole, *at)

        self._crew.run(Task(len(sides)), _rows(links, whole), gather)
        gathered += near
        change = float(np.abs(gathered - self.gathered).sum(dtype=np.float64))
        self.gathered = gathered
        return change / max(float(np.abs(gathered).sum(dtype=np.float64)), 1e-30)

    def follow(
        self,
        n: int,
        direct: np.ndarray,
        near: np.ndarray,
        links: Links,
        sides: np.ndarray,
        of: Reflectance,
        whole: bool,
    ) -> None:
        """N bounces of what has changed, and what those after them add if each is the same share of the one before."""
        before = np.zeros(3)
        for _ in range(max(n, 1)):
            last, was = before, self.gathered
            self.bounce(direct, near, links, sides, of, whole)
            added = self.gathered - was
            before = np.abs(added).sum(axis=0, dtype=np.float64)
        share = np.clip(before / np.maximum(last, 1e-30), 0, _LARGEST_SHARE) if n > 1 else np.zeros(3)
        self.gathered = self.gathered + added * (share / (1 - share)).astype(np.float32)

    def radiate(self, direct: np.ndarray, of: Reflectance) -> None:
        """L of D and G."""

        def radiate(chunk: slice) -> None:
            at = chunk.start, chunk.stop, self.radiance
            _radiate(of.albedo, of.translucence, direct, self.gathered, *at)

        self._crew.run(Task(len(self.radiance)), 1 << 14, radiate)

    def to_vertices(self, links: Links, gathered: np.ndarray, variance: np.ndarray, whole: bool = True) -> None:
        """What vertices gather of L, (n, 3), and its variance, (n,); of the mean over colours."""

        def gather(chunk: slice) -> None:
            at = self.radiance, chunk.start, chunk.stop, gathered, self._ratio_of_vertices, variance
            _gather_vertices(links.arrays, links.n_first, links.n_traced, whole, *at)

        self._crew.run(Task(len(gathered)), _rows(links, whole), gather)


def _rows(links: Links, whole: bool) -> int:
    """Of a chunk."""
    return max(1, _CHUNK // max(links.n_traced if whole else links.n_first, 1))
