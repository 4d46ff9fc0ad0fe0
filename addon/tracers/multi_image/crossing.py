"""The first surface that a ray crosses in the maps, found by walking along it over mip levels.

On a face of a cube a ray is a straight line. Where it stays nearer than everything in a cell of a mip level, the whole
cell is free: the walk takes free space in large steps and comes down to single texels only near surfaces. There the
ray meets the plane that the texel saw, or passes it, or slips behind it. Behind, the map does not see the ray any more,
so the walk goes on in another map that does. Whatever was walked is known to be free; so the first crossing is the hit.

Where no map sees a ray it walks behind surfaces, by the same rules with near and far exchanged: it comes out from
behind them, or meets a thin surface from its back.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from ...sampling.vectors import dot
from .cube_maps import CubeMaps, on_faces, onto_faces
from .found import Found
from .guide import Guide

_MAX_WALKS = 8
_MAX_STEPS = 512  # of a walk: a ray crosses at most about 4 size texels
_FIRST_LEVEL = 2
_NUDGE = np.float32(2**-16)  # over a cell's border, in depths z
_ON_SURFACE = np.float32(2**-12)  # in depths z: from nearer to a plane, a ray that goes in may have started behind it
_SLACK = np.float32(1 / 64)  # in texels: how far behind the plane of its own surface a ray may start
_CRACK = np.float32(1 / 4)  # in texels: how far the planes of neighbours are apart where they should meet


class _End(IntEnum):
    """How a walk in one map ends."""

    OPEN = 0
    HIT = 1
    TURNED = 2  # behind surfaces, or out from behind them
    GONE = 3


@dataclass(frozen=True)
class Crossing:
    """Finds the first crossings of rays with the surfaces of maps; `Found.loops` are the walks."""

    maps: CubeMaps
    guide: Guide

    def find(self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray) -> Found:
        """Where rays (n, 3) meet a surface nearer than `t_max` (n,)."""
        found = Found.none(len(origins))
        s, live = np.zeros(len(origins), np.float32), np.arange(len(origins))
        for _ in range(_MAX_WALKS):
            t, r, s_max = origins[live], directions[live], t_max[live]
            which, behind = self._choose(t + s[live, None] * r, r, found)
            # Where no map sees the ray, one may a little further on
            limit = np.where(behind, np.minimum(s_max, s[live] + np.float32(self.guide.reach)), s_max)
            walk = _Walk(self.maps, which, behind, t, r, s[live], limit)
            walk.run(found)
            walk.end[(walk.end == _End.GONE) & (limit < s_max)] = _End.TURNED
            s[live] = np.minimum(walk.s, limit)
            hit = walk.end == _End.HIT
            found.distance[live[hit]], found.texel[live[hit]] = walk.s[hit], walk.texel[hit]
            found.loops[live] += 1
            live = live[walk.end == _End.TURNED]
            if len(live) == 0:
                break
        return found

    def _choose(self, x: np.ndarray, r: np.ndarray, found: Found) -> tuple[np.ndarray, np.ndarray]:
        """Maps (n,) for rays that are at x (n, 3), and whether the rays are behind what these maps see, (n,) bool.

        The first of the guide's choices that sees x, or else the one in which x is least behind a surface.
        """
        choices = self.guide.at(x)
        which, best = choices[:, 0].copy(), np.full(len(x), -np.inf, np.float32)
        open_ = np.arange(len(x))
        for choice in choices.T:
            candidate = choice[open_]
            p = x[open_] - self.maps.centres[candidate]
            texel, z = self.maps.texel(candidate, p)
            found.n_look_ups += len(open_)
            n, h = self.maps.plane(texel)
            # A surface that the ray comes out of is its own; one that it goes into has to be clearly ahead
            least = np.where(dot(n, r[open_]) < 0, _ON_SURFACE, -_SLACK * (2 / self.maps.size)) * z
            above = dot(n, p) - h - least
            better = above > best[open_]
            which[open_[better]], best[open_[better]] = candidate[better], above[better]
            open_ = open_[above < 0]
            if len(open_) == 0:
                break
        return which, best < 0


class _Walk:
    """Rays t + s r (n of each), each on its way through one map, on one side of the surfaces.

    Attributes
    ----------
    end : (n,) int8
        `_End`.
    s : (n,) float32, m
        How far the rays have come.
    texel : (n,) int64
        Where they ended.
    """

    def __init__(
        self,
        maps: CubeMaps,
        which: np.ndarray,
        behind: np.ndarray,
        t: np.ndarray,
        r: np.ndarray,
        s: np.ndarray,
        s_max: np.ndarray,
    ) -> None:
        self._maps, self._which, self._behind, self._start, self._s_max = maps, which, behind, s, s_max
        self._t, self._r = t - maps.centres[which], r
        self.s, self.end, self.texel = s.copy(), np.zeros(len(s), np.int8), np.full(len(s), -1)
        self._level = np.full(len(s), min(_FIRST_LEVEL, maps.n_levels - 1))
        # The rays in the frames of the faces that they are on, as rows
        self._face = np.empty(len(s), np.int64)
        self._local_t, self._local_r = np.empty((2, 3, len(s)), np.float32)
        self._turn(np.arange(len(s)))

    def run(self, found: Found) -> None:
        """Walk until every ray has ended."""
        live = np.arange(len(self.s))
        for _ in range(_MAX_STEPS):
            if len(live) == 0:
                return
            found.n_look_ups += len(live)
            self._step(live)
            live = live[self.end[live] == _End.OPEN]
        self.end[live] = _End.GONE

    def _turn(self, k: np.ndarray) -> None:
        """Find the faces that rays k are on."""
        face, axes, sign = on_faces(self._t[k] + self.s[k, None] * self._r[k])
        self._face[k] = self._which[k] * 6 + face
        self._local_t[:, k], self._local_r[:, k] = (onto_faces(a[k], axes, sign) for a in (self._t, self._r))

    def _step(self, k: np.ndarray) -> None:
        """Take rays k over the cells that they are in if these are free, or else one level down, or to an end."""
        p = self._local_t[:, k] + self.s[k] * self._local_r[:, k]
        left = np.flatnonzero(np.maximum(np.abs(p[1]), np.abs(p[2])) > p[0])
        if len(left):
            self._turn(k[left])
            p[:, left] = self._local_t[:, k[left]] + self.s[k[left]] * self._local_r[:, k[left]]
        level = self._level[k]
        cell, length = self._cell(k, p, level)
        with np.errstate(invalid="ignore"):
            z_exit = p[0] + self._local_r[0, k] * length  # NaN where z stays the same for ever
        free = np.fmax(p[0], z_exit) <= self._maps.nearest[cell]  # also where both are infinite
        behind = np.flatnonzero(self._behind[k])
        free[behind] = np.fmin(p[0], z_exit)[behind] > self._maps.farthest[cell[behind]]

        last = np.flatnonzero(~free & (level == 0))
        way, self.end[k[last]] = self._meet(k[last], p[0, last], cell[last], length[last])
        self.s[k[last]] += way
        self.texel[k[last]] = cell[last]
        free[last] = self.end[k[last]] == _End.OPEN
        onward = np.where(free, length + _NUDGE * p[0], 0)
        self.s[k] += onward
        self.end[k[~(self.s[k] < self._s_max[k]) & free]] = _End.GONE
        self._level[k] = np.where(free, np.minimum(level + 1, self._maps.n_levels - 1), np.maximum(level - 1, 0))

    def _cell(self, k: np.ndarray, p: np.ndarray, level: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The cells of mip levels (n,) that rays k are in at p (3, n), and the way to where they leave them.

        A ray's slope p_i / z grows all along it, or falls; it leaves over the border that it tends to, if ever.
        """
        z, r_z = np.maximum(p[0], np.float32(1e-30)), self._local_r[0, k]
        side = self._maps.size >> level
        width = np.float32(2) / side.astype(np.float32)
        cell, length = self._face[k], np.full(len(k), np.inf, np.float32)
        for p_i, r_i in zip(p[1:], self._local_r[1:, k], strict=True):
            at = np.minimum(((p_i / z + 1) / width).astype(np.int64), side - 1)
            up = r_i * z > p_i * r_z
            border = (at + up) * width - 1
            sign = np.where(up, np.float32(1), np.float32(-1))
            ahead, rate = np.maximum((border * z - p_i) * sign, 0), (r_i - border * r_z) * sign
            np.minimum(length, np.divide(ahead, rate, out=np.full_like(length, np.inf), where=rate > 0), out=length)
            cell = cell * side + at
        return self._maps.level_start[level] + cell, length

    def _meet(
        self, k: np.ndarray, z: np.ndarray, texel: np.ndarray, length: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """How far rays k get in texels that they cross for `length` (n,) unless something ends them, and what does.

        A crossing is a hit if the ray comes from its own side of the surface. One that lies a little before the texel
        counts too: the planes of neighbours do not quite meet on their border.
        """
        n, h = self._maps.plane(texel)
        texel_width = (2 / self._maps.size) * z
        turned_below = -2 * _SLACK * texel_width
        side = np.where(self._behind[k], np.float32(-1), np.float32(1))
        above = side * (dot(n, self._t[k]) + self.s[k] * dot(n, self._r[k]) - h)
        rate = side * dot(n, self._r[k])
        with np.errstate(divide="ignore", invalid="ignore"):
            above_at_exit = above + rate * length
            to_hit, to_turn = -above / rate, (turned_below - above) / rate
        crack = np.where(self.s[k] > self._start[k], _CRACK * texel_width, 0)
        hit = (rate < 0) & (above_at_exit <= 0) & (above >= -crack)
        turned = ~hit & ~(above_at_exit >= turned_below)
        way = np.where(hit, to_hit, np.where(turned & (rate < 0) & (above > turned_below), to_turn, 0))
        return np.maximum(way, 0), np.where(hit, _End.HIT, np.where(turned, _End.TURNED, _End.OPEN))
