"""Strands of hair as tubes of triangles: Catmull–Rom curves with a radius, in a bounded number of triangles.

By Cauchy's formula a convex body shows a quarter of its surface in the mean over all directions. A prism whose outline
is as long as a cylinder's circle thus blocks as much light. With a turn about its axis that is random it also scatters
the same in the mean: each of its faces then looks every way that the cylinder's surface looks, equally often, and light
is the sum of theirs. So few sides do, with normals that are the faces' own; where there are so few strands that each
is seen, tubes have more sides and smooth normals.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...core.ranges import repeat_ranges

MOST_TRIANGLES = 1_000_000
"""Of one object's hair; where it would be more, curves have fewer segments, and then there are fewer strands."""

FINE = 50_000
"""Triangles up to which tubes have `ROUND` sides."""

ROUND = 16
"""Sides from which on tubes have smooth normals. These take sin(π/n) / (π/n) of the light that the faces' own do, as
that is their mean cosine with them: 0.6 % less of 16 sides, 10 % less of 4.
"""

BEND, UNEVEN = 0.3, 0.25
"""What a segment may stand for: a turn in rad, and a change of the radius' slope in radii."""

MOST_STRANDS = MOST_TRIANGLES // 12
"""Of one object, in two segments of three sides each."""

_FINE_STEPS = 4  # of the curve between two keys, for its area and at most for its tubes
_CHUNK = 1 << 16


@dataclass(frozen=True)
class Strands:
    """Curves with a radius: s strands of k keys in all, those of strand i from `start[i]` to `start[i + 1]`.

    Attributes
    ----------
    positions : (k, 3) float32
    radii : (k,) float32
    start : (s + 1,) int64
    uvs : dict of str to (s, 2) float32
        Texture coordinates of the strands by their name; the empty name is the map of textures that name none.
    random : (s,) float32
        A number in [0, 1] of each.
    """

    positions: np.ndarray
    radii: np.ndarray
    start: np.ndarray
    uvs: dict[str, np.ndarray]
    random: np.ndarray

    def __len__(self) -> int:
        return len(self.start) - 1

    @property
    def sizes(self) -> np.ndarray:
        """Keys of each strand, (s,)."""
        return np.diff(self.start)

    def mean_size(self) -> tuple[float, float]:
        """Mean length, and mean thickness over that length."""
        length = float(_lengths(self).sum())
        return length / max(len(self), 1), float(_areas(self).sum()) / max(length, 1e-30)

    def take(self, chosen: np.ndarray) -> "Strands":
        """Some of the strands, by index."""
        sizes = self.sizes[chosen]
        strand, nth = repeat_ranges(sizes)
        keys = self.start[chosen][strand] + nth
        uvs = {name: uv[chosen] for name, uv in self.uvs.items()}
        return Strands(self.positions[keys], self.radii[keys], _ends(sizes), uvs, self.random[chosen])

    def whole(self) -> "Strands":
        """Those that are curves: of two keys or more that are finite, not all in one place, and somewhere thick."""
        some = self.take(np.flatnonzero(self.sizes > 1))
        if not len(some):
            return some
        first = some.start[:-1]
        good = np.isfinite(some.positions).all(axis=1) & (some.radii >= 0) & np.isfinite(some.radii)
        good = np.logical_and.reduceat(good, first)
        with np.errstate(invalid="ignore"):
            thick, long = np.maximum.reduceat(some.radii, first) > 0, np.add.reduceat(_lengths(some), first) > 0
        return some.take(np.flatnonzero(good & thick & long))


def thinned(n: int, most: int) -> np.ndarray:
    """At most `most` of n indices, one drawn out of each of as many equal stretches."""
    if n <= most:
        return np.arange(n)
    drawn = np.random.default_rng(0).random(most)
    return np.minimum(((np.arange(most) + drawn) * (n / most)).astype(np.int64), n - 1)


@dataclass(frozen=True)
class Tubes:
    """Strands as they become triangles: rings of vertices around points of the curves.

    Attributes
    ----------
    rings : Strands
        Whose keys are the rings' middles; their radii are such that the triangles have the curves' area.
    along : (k,) float32
        Share of each strand's length before each ring.
    sides : int
    closed : bool
        Whether the ends of tubes are, which look along the strands.
    """

    rings: Strands
    along: np.ndarray
    sides: int
    closed: bool

    @staticmethod
    def of(strands: Strands, straight: bool = False, closed: bool = False, most: int = MOST_TRIANGLES) -> "Tubes":
        """Tubes around `whole` strands, of at most about so many triangles.

        Parameters
        ----------
        straight : bool
            Whether keys are joined by straight lines, not by curves.
        closed : bool
            Whether the tubes' ends are.
        """
        segments = wanted_segments(strands, straight)
        n = int(segments.sum())
        sides = ROUND if 2 * ROUND * n <= min(FINE, most) else 4 if 8 * n <= most // 4 else 3
        if 2 * sides * n > most:
            segments = np.maximum(segments * (most / (2 * sides * n)), 1).astype(np.int64)
        strand, step = repeat_ranges(segments + 1)
        positions, radii = _curve(strands, strand, step / segments[strand], straight)
        rings = replace(strands, positions=positions, radii=radii, start=_ends(segments + 1))
        areas = _areas(rings)
        radii = radii * (_curve_areas(strands, straight) / np.maximum(areas, 1e-30)).astype(np.float32)[strand]
        return Tubes(replace(rings, radii=radii), _along(rings), sides, closed)

    @property
    def n_vertices(self) -> int:
        return len(self.rings.positions) * self.sides

    @property
    def n_triangles(self) -> int:
        return self.n_around + (2 * (self.sides - 2) * len(self.rings) if self.closed else 0)

    @property
    def n_around(self) -> int:
        """How many of the triangles, the first, lie around strands and not over their ends."""
        return 2 * self.sides * (len(self.rings.positions) - len(self.rings))

    @property
    def strand_of_vertex(self) -> np.ndarray:
        """(v,) int64."""
        return np.repeat(np.arange(len(self.rings)), self.rings.sizes * self.sides)

    def triangles(self) -> np.ndarray:
        """Vertices of the triangles, whose normals point outward, (t, 3) int32."""
        ring = np.delete(np.arange(len(self.rings.positions)), self.rings.start[1:] - 1)
        a = ring[:, None] * self.sides + np.arange(self.sides)
        b = ring[:, None] * self.sides + (np.arange(self.sides) + 1) % self.sides
        around = np.stack([a, b, b + self.sides, a, b + self.sides, a + self.sides], -1).reshape(-1, 3)
        if not self.closed:
            return around.astype(np.int32)
        fan = np.stack([np.zeros(self.sides - 2), np.arange(1, self.sides - 1), np.arange(2, self.sides)], 1).astype(
            int
        )
        low = self.sides * self.rings.start[:-1, None, None] + fan[:, ::-1]
        high = self.sides * (self.rings.start[1:, None, None] - 1) + fan
        return np.concatenate([around, low.reshape(-1, 3), high.reshape(-1, 3)]).astype(np.int32)

    def directions(self) -> np.ndarray:
        """Unit vector along the strand at each vertex, (v, 3) float32."""
        along = np.empty((len(self.rings.positions), 3), np.float32)
        for rows, _ in _rings_in_step(self.rings):
            along[rows] = _tangents(self.rings.positions[rows])
        return np.repeat(along, self.sides, axis=0)

    def outward(self) -> np.ndarray:
        """Unit vector from each ring's middle to each of its vertices, (v, 3) float32."""
        turn = (2 * np.pi * np.random.default_rng(1).random(len(self.rings)))[:, None]
        out = np.empty((len(self.rings.positions), self.sides, 3), np.float32)
        angle = turn + 2 * np.pi * np.arange(self.sides) / self.sides
        cos, sin = np.cos(angle)[..., None], np.sin(angle)[..., None]
        for rows, strands in _rings_in_step(self.rings):
            tangents = _tangents(self.rings.positions[rows])
            x = _any_normal(tangents[:, 0])
            for i in range(rows.shape[1]):
                t = tangents[:, i]
                x = _unit(x - np.einsum("nj,nj->n", x, t)[:, None] * t, t)
                y = np.cross(t, x)
                out[rows[:, i]] = cos[strands] * x[:, None] + sin[strands] * y[:, None]
        return out.reshape(-1, 3)

    def vertices(self, outward: np.ndarray) -> np.ndarray:
        """Vertices, (v, 3) float32, on polygons whose outlines are as long as the rings' circles.

        A polygon of n sides with the circumradius R is 2 n R sin(π/n) around.
        """
        scale = np.pi / (self.sides * np.sin(np.pi / self.sides))
        radii = np.repeat(self.rings.radii * np.float32(scale), self.sides)
        return np.repeat(self.rings.positions, self.sides, axis=0) + radii[:, None] * outward


def wanted_segments(strands: Strands, straight: bool = False) -> np.ndarray:
    """Segments that show how each strand bends and how its radius changes, (s,) int64."""
    steps = strands.sizes - 1
    if straight:
        return steps
    if not len(strands):
        return steps
    inner = np.ones(len(strands.positions), bool)
    inner[strands.start[:-1]] = inner[strands.start[1:] - 1] = False
    middle = np.flatnonzero(inner)
    before, after = (strands.positions[middle] - strands.positions[middle - 1] for middle in (middle, middle + 1))
    sine = np.linalg.norm(np.cross(before, after), axis=1)
    turn, uneven = np.zeros((2, len(inner)))
    turn[middle] = np.arctan2(sine, np.einsum("nj,nj->n", before, after))
    uneven[middle] = np.abs(strands.radii[middle + 1] - 2 * strands.radii[middle] + strands.radii[middle - 1])
    thickest = np.maximum.reduceat(strands.radii, strands.start[:-1])
    wanted = np.add.reduceat(turn, strands.start[:-1]) / BEND
    wanted = np.maximum(wanted, np.add.reduceat(uneven, strands.start[:-1]) / (UNEVEN * thickest))
    # What needs nearly as many as there are keys, or more, has its rings at the keys
    at_keys = np.ceil(wanted / steps) * steps
    wanted = np.where(wanted > steps / 2, np.minimum(at_keys, _FINE_STEPS * steps), np.ceil(wanted))
    return np.maximum(wanted, 1).astype(np.int64)


def _curve(strands: Strands, strand: np.ndarray, at: np.ndarray, straight: bool) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, 3) and radii (n,) on curves through their keys, at a share of their keys' steps.

    Cycles' curves are of Catmull and Rom, with their first and last key twice.
    """
    first, steps = strands.start[:-1][strand], strands.sizes[strand] - 1
    t = at * steps
    i = np.minimum(t.astype(np.int64), steps - 1)
    f = t - i
    parts = [(i, 1 - f), (i + 1, f)]
    if not straight:
        parts = [
            (np.maximum(i - 1, 0), (-f + 2 * f**2 - f**3) / 2),
            (i, (2 - 5 * f**2 + 3 * f**3) / 2),
            (i + 1, (f + 4 * f**2 - 3 * f**3) / 2),
            (np.minimum(i + 2, steps), (f**3 - f**2) / 2),
        ]
    positions = sum(weight[:, None] * strands.positions[first + key] for key, weight in parts)
    radii = sum(weight * strands.radii[first + key] for key, weight in parts)
    return np.asarray(positions, np.float32), np.maximum(np.asarray(radii, np.float32), 0)


def _curve_areas(strands: Strands, straight: bool) -> np.ndarray:
    """Length times mean width of each strand's curve, (s,) float64."""
    areas = np.empty(len(strands))
    for low in range(0, len(strands), _CHUNK):
        part = strands.take(np.arange(low, min(low + _CHUNK, len(strands))))
        n = _FINE_STEPS * (part.sizes - 1)
        strand, step = repeat_ranges(n + 1)
        positions, radii = _curve(part, strand, step / n[strand], straight)
        areas[low : low + _CHUNK] = _areas(replace(part, positions=positions, radii=radii, start=_ends(n + 1)))
    return areas


def _areas(strands: Strands) -> np.ndarray:
    """Length times mean width of each strand's straight pieces, (s,) float64."""
    if not len(strands):
        return np.zeros(0)
    pieces = _lengths(strands)
    pieces[1:] *= strands.radii[1:] + strands.radii[:-1]
    return np.add.reduceat(pieces, strands.start[:-1])


def _along(strands: Strands) -> np.ndarray:
    """Share of each strand's length before each key, (k,) float32."""
    if not len(strands):
        return np.zeros(0, np.float32)
    lengths = _lengths(strands)
    whole = np.add.reduceat(lengths, strands.start[:-1])
    before = np.cumsum(lengths)
    before -= np.repeat(before[strands.start[:-1]], strands.sizes)
    return (before / np.repeat(np.maximum(whole, 1e-30), strands.sizes)).astype(np.float32)


def _lengths(strands: Strands) -> np.ndarray:
    """Length of the piece that ends at each key, (k,) float64; 0 at first keys."""
    lengths = np.zeros(len(strands.positions))
    lengths[1:] = np.linalg.norm(np.diff(strands.positions, axis=0), axis=1)
    lengths[strands.start[:-1]] = 0
    return lengths


def _rings_in_step(rings: Strands) -> list[tuple[np.ndarray, np.ndarray]]:
    """Strands with equally many rings: their rings (n, m), and which strands they are (n,)."""
    found = []
    for size in np.unique(rings.sizes):
        strands = np.flatnonzero(rings.sizes == size)
        found.append((rings.start[strands][:, None] + np.arange(size), strands))
    return found


def _tangents(positions: np.ndarray) -> np.ndarray:
    """Unit directions of n strands (n, m, 3) at their points: between the neighbours of each."""
    ahead = np.concatenate([positions[:, 1:], positions[:, -1:]], axis=1)
    behind = np.concatenate([positions[:, :1], positions[:, :-1]], axis=1)
    whole = (positions[:, -1] - positions[:, 0])[:, None]
    return _unit(ahead - behind, _unit(whole, np.array([0.0, 0, 1])))


def _unit(vectors: np.ndarray, otherwise: np.ndarray) -> np.ndarray:
    """Vectors of length 1, and others where there is nothing of a length."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(length > 1e-20, vectors / np.maximum(length, 1e-20), otherwise)


def _any_normal(directions: np.ndarray) -> np.ndarray:
    """A unit vector across each unit vector, (n, 3)."""
    least = np.abs(directions).argmin(axis=1)
    across = np.cross(directions, np.eye(3)[least])
    return across / np.linalg.norm(across, axis=1, keepdims=True)


def _ends(sizes: np.ndarray) -> np.ndarray:
    """Where runs of some sizes start and end, (n + 1,) int64."""
    return np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
