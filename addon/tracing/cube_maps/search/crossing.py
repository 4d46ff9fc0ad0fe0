"""The first surface that a ray crosses in the maps: walks through one map after the other.

Whatever a ray has walked through is known to be free, so the first crossing is the hit. Behind a surface a map does not
see the ray any more: then the walk goes on in another map that does. Where none does, the ray walks behind the surfaces
until it comes out again, or meets a thin one from its back.
"""

from dataclasses import dataclass

import numpy as np

from ....core.sampling.vectors import dot
from ..cube_maps import CubeMaps
from .hierarchical_traversal import SLACK, End, Walk
from .map_hit import Found
from .map_index import Guide

_MAX_WALKS = 8
_AHEAD = np.float32(1 / 16)  # in texels: a ray that goes in from nearer to a plane may have started behind it


@dataclass(frozen=True)
class Crossing:
    """Finds the first crossings of rays with the surfaces of maps; `Found.loops` are the walks."""

    maps: CubeMaps
    guide: Guide

    def find(self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray) -> Found:
        """See `Method.find`."""
        found = Found.none(len(origins))
        s, slipped = np.zeros(len(origins), np.float32), np.full(len(origins), np.inf, np.float32)
        live = np.arange(len(origins))
        for _ in range(_MAX_WALKS):
            which, behind = self._choose(origins[live] + s[live, None] * directions[live], directions[live], found)
            # What slipped in at an edge, and is seen no more, has gone into the surface there
            inside = behind & np.isfinite(slipped[live])
            found.distance[live[inside]] = slipped[live[inside]]
            live, which, behind = live[~inside], which[~inside], behind[~inside]

            # Where no map sees a ray, one may a little further on
            limit = np.where(behind, np.minimum(t_max[live], s[live] + np.float32(self.guide.reach)), t_max[live])
            walk = Walk(self.maps, which, behind, origins[live], directions[live], s[live], limit)
            walk.run(found)
            hit = walk.end == End.HIT
            found.distance[live[hit]] = walk.s[hit]
            found.texel[live] = walk.texel
            found.loops[live] += 1
            s[live], slipped[live] = np.minimum(walk.s, limit), walk.slipped
            live = live[(walk.end == End.TURNED) | ((walk.end == End.GONE) & (limit < t_max[live]))]
            if len(live) == 0:
                break
        found.texel[np.isinf(found.distance)] = -1
        return found

    def _choose(self, x: np.ndarray, r: np.ndarray, found: Found) -> tuple[np.ndarray, np.ndarray]:
        """Maps (n,) for rays that are at x (n, 3), and whether the rays are behind what these maps see, (n,) bool.

        The first of the guide's choices that sees x, or else the one in which x is least behind a surface.
        """
        choices = self.guide.at(x)
        which, behind = choices[:, 0].copy(), np.zeros(len(x), bool)
        most = np.full(len(x), -np.inf, np.float32)
        open_ = np.arange(len(x))
        for choice in choices.T:
            candidate = choice[open_]
            p = x[open_] - self.maps.centres[candidate]
            texel, z = self.maps.texel(candidate, p)
            found.n_look_ups += len(open_)
            n, h = self.maps.plane(texel)
            above = (dot(n, p) - h) / (z * (2 / self.maps.size))
            # A surface that the ray comes out of is its own; one that it goes into has to be clearly ahead
            goes_in = dot(n, r[open_]) < 0
            clearance = above - np.where(goes_in, _AHEAD, -SLACK)
            more = clearance > most[open_]
            k = open_[more]
            which[k], most[k] = candidate[more], clearance[more]
            behind[k] = above[more] < np.where(goes_in[more], 0, -SLACK)
            open_ = open_[clearance < 0]
            if len(open_) == 0:
                break
        return which, behind
