"""The first surface that a ray crosses in the maps: walks through one map after the other.

Whatever a ray has walked through is known to be free, so the first crossing is the hit. Behind a surface a map does not
see the ray any more: then the walk goes on in another map that does. Where none does, the ray walks behind the surfaces
until it comes out again, or meets a thin one from its back.
"""

from dataclasses import dataclass

import numpy as np

from ....core.compiling import kernel, kernel_array, part
from ....core.vec3 import ONE, ZERO, along, minus, row
from ..cube_maps import CubeMaps
from ..texels import above_plane
from .hierarchical_traversal import SLACK, End, walk
from .map_hit import MapHits
from .map_index import MapIndex, cell_at

_MAX_WALKS = 8
_AHEAD = np.float32(1 / 16)  # in texels: a ray that goes in from nearer to a plane may have started behind it
_INFINITY = np.float32(np.inf)
_NO_TEXEL = np.int64(-1)
_HIT, _TURNED = int(End.HIT), int(End.TURNED)


@part
def first_crossing(maps, index, origin, direction, t_max):
    """Distance and texel (−1: none) where a ray first crosses a surface, and how many walks and look-ups that took."""
    s, slipped, texel, n_look_ups = ZERO, _INFINITY, _NO_TEXEL, 0
    for n_walks in range(_MAX_WALKS):
        which, behind, n_asked = _choose(maps, index, along(origin, s, direction), direction)
        n_look_ups += n_asked
        if behind and slipped < _INFINITY:
            # What slipped in at an edge, and is seen no more, has gone into the surface there
            return slipped, texel, n_walks, n_look_ups
        # Where no map sees a ray, one may a little further on
        limit = min(t_max, s + index.reach) if behind else t_max
        t, side = minus(origin, row(maps.centres, which)), -ONE if behind else ONE
        end, s, texel, slipped, n_steps = walk(maps, which, side, t, direction, s, limit)
        n_look_ups += n_steps
        if end == _HIT:
            return s, texel, n_walks + 1, n_look_ups
        s = min(s, limit)
        if end != _TURNED and limit >= t_max:
            return _INFINITY, _NO_TEXEL, n_walks + 1, n_look_ups
    return _INFINITY, _NO_TEXEL, _MAX_WALKS, n_look_ups


@part
def _choose(maps, index, x, direction):
    """A map for a ray that is at x, whether the ray is behind what it sees, and how many maps were asked.

    The first of the index's choices that sees x, or else the one in which x is least behind a surface.
    """
    cell = cell_at(index, x)
    which, behind, most = np.int64(index.choices[cell, 0]), False, -_INFINITY
    n = index.choices.shape[1]
    for choice in range(n):
        candidate = np.int64(index.choices[cell, choice])
        above, goes_in = above_plane(maps, candidate, x, direction)
        # A surface that the ray comes out of is its own; one that it goes into has to be clearly ahead
        clearance = above - (_AHEAD if goes_in else -SLACK)
        if clearance > most:
            which, most = candidate, clearance
            behind = above < (ZERO if goes_in else -SLACK)
        if not clearance < 0:
            return which, behind, choice + 1
    return which, behind, n


@kernel
def first_crossings(maps, index, origins, directions, t_max, distance, texel, n_walks, n_look_ups):
    """`first_crossing` of many."""
    for i in range(len(origins)):
        distance[i], texel[i], n_walks[i], n_look_ups[i] = first_crossing(
            maps, index, row(origins, i), row(directions, i), t_max[i]
        )


@dataclass(frozen=True)
class Crossing:
    """Finds the first crossings of rays with the surfaces of maps; `MapHits.loops` are the walks."""

    maps: CubeMaps
    index: MapIndex

    def find(self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray) -> MapHits:
        """See `Method.find`."""
        found, n_look_ups = MapHits.none(len(origins)), np.zeros(len(origins), np.int32)
        first_crossings(
            self.maps.arrays,
            self.index.arrays,
            kernel_array(origins, np.float32),
            kernel_array(directions, np.float32),
            kernel_array(t_max, np.float32),
            found.distance,
            found.texel,
            found.loops,
            n_look_ups,
        )
        found.n_look_ups = int(n_look_ups.sum())
        return found
