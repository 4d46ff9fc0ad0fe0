"""The way of rays through one map each, until they cross a surface or it hides them.

On a face of a cube a ray is a straight line. Where it stays nearer than everything in a cell of a mip level, the whole
cell is free: the walk takes free space in large steps and comes down to single texels only near surfaces. There the
ray meets the plane that the texel saw, or passes it, or slips behind it.
"""

from enum import IntEnum

import numpy as np

from ....core.sampling.vectors import dot
from ..cube_maps import CubeMaps, on_faces, onto_faces
from .map_hit import Found

SLACK = np.float32(1 / 64)
"""In texels: how far behind the plane of its own surface a ray may start."""

_CRACK = np.float32(1 / 4)  # in texels: how far the planes of neighbours are apart where they should meet
_FIRST_LEVEL = 2
_MAX_STEPS = 512  # a ray crosses at most about 4 size texels
_NUDGE = np.float32(2**-16)  # over a cell's border, in depths z


class End(IntEnum):
    """How a walk ends."""

    OPEN = 0
    HIT = 1
    TURNED = 2  # behind surfaces, or out from behind them
    GONE = 3


class Walk:
    """Rays t + s r that walk, each through one map and on one side of its surfaces, as long as s < `s_max`.

    Behind surfaces the rules are the same with near and far exchanged.

    Parameters
    ----------
    which : (n,) int
        Map of each ray.
    behind : (n,) bool
        Whether it is behind what the map sees.
    origins, directions : (n, 3) float32, m
        In world space.
    s, s_max : (n,) float32, m
        Where on the rays walks start, and end at the latest.

    Attributes
    ----------
    end : (n,) int8
        `End`.
    s : (n,) float32, m
        How far the rays came.
    texel : (n,) int64
        What ended them.
    slipped : (n,) float32, m
        Where rays that turned crossed the plane of what hides them, if they did just before they came to its texel, as
        they do where two surfaces meet in an edge; else infinite.
    """

    def __init__(
        self,
        maps: CubeMaps,
        which: np.ndarray,
        behind: np.ndarray,
        origins: np.ndarray,
        directions: np.ndarray,
        s: np.ndarray,
        s_max: np.ndarray,
    ) -> None:
        n = len(s)
        self._maps, self._which, self._side = maps, which, np.where(behind, np.float32(-1), np.float32(1))
        self._t, self._r = origins - maps.centres[which], directions
        self._start, self._s_before, self._s_max = s, s.copy(), s_max
        self.s, self.end, self.texel = s.copy(), np.zeros(n, np.int8), np.full(n, -1)
        self.slipped = np.full(n, np.inf, np.float32)
        self._level = np.full(n, min(_FIRST_LEVEL, maps.n_levels - 1))
        # The rays in the frames of the faces that they are on, as rows
        self._face = np.empty(n, np.int64)
        self._local_t, self._local_r = np.empty((2, 3, n), np.float32)
        self._turn(np.arange(n))

    def run(self, found: Found) -> None:
        """Walk until every ray has ended."""
        live = np.arange(len(self.s))
        for _ in range(_MAX_STEPS):
            if len(live) == 0:
                return
            found.n_look_ups += len(live)
            self._step(live)
            live = live[self.end[live] == End.OPEN]
        self.end[live] = End.GONE

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
        behind = np.flatnonzero(self._side[k] < 0)
        free[behind] = np.fmin(p[0], z_exit)[behind] > self._maps.farthest[cell[behind]]

        # Where single texels are not free, see what they do to the rays
        last = np.flatnonzero(~free & (level == 0))
        self._meet(k[last], p[0, last], cell[last], length[last])
        free[last] = self.end[k[last]] == End.OPEN

        on = k[free]
        self._s_before[on] = self.s[on]
        self.s[on] += (length + _NUDGE * p[0])[free]
        self._level[k] = np.where(free, np.minimum(level + 1, self._maps.n_levels - 1), np.maximum(level - 1, 0))
        self.end[k[~(self.s[k] < self._s_max[k])]] = End.GONE

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

    def _meet(self, k: np.ndarray, z: np.ndarray, texel: np.ndarray, length: np.ndarray) -> None:
        """End rays k if they meet or slip behind what texels saw, which they cross for `length` (n,).

        A crossing is a hit if the ray comes from its own side of the surface. One that lies a little before the texel
        counts too: the planes of neighbours do not quite meet on their border.
        """
        normal, h = self._maps.plane(texel)
        texel_width = z * (2 / self._maps.size)
        height = self._side[k] * (dot(normal, self._t[k]) + self.s[k] * dot(normal, self._r[k]) - h)
        rate = self._side[k] * dot(normal, self._r[k])
        crack = np.where(self.s[k] > self._start[k], _CRACK * texel_width, 0)
        below = -2 * SLACK * texel_width
        with np.errstate(divide="ignore", invalid="ignore"):
            height_at_exit = height + rate * length
            to_hit, to_below = -height / rate, (below - height) / rate
        hit = (rate < 0) & (height_at_exit <= 0) & (height >= -crack)
        turned = ~hit & ~(height_at_exit >= below)
        self.end[k] = np.where(hit, End.HIT, np.where(turned, End.TURNED, End.OPEN))
        self.texel[k] = texel

        slipped = turned & (rate < 0) & (height >= rate * (self.s[k] - self._s_before[k]))
        self.slipped[k[slipped]] = (self.s[k] + to_hit)[slipped]
        way = np.where(hit, to_hit, np.where(turned & (rate < 0) & (height > below), to_below, 0))
        self.s[k] += np.maximum(way, 0)
