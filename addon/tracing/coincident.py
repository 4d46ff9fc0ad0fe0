"""Surfaces that lie in one and the same place, as walls do that were modelled twice.

There Cycles is dark: a ray that leaves one of the two surfaces meets the other at once, so neither light nor looks get
away. What a scene means is what Cycles makes of it; a tracer that steps off the surface would make such walls bright.

Where one of the two emits, what Cycles shows depends on which of them its tree of boxes finds first, and on rounding:
one and the same panel in a wall gave 0.02 to 0.13, by the order of the objects, the diagonals and the walls' tilt. Here
it counts as lying in front, which gives what Cycles shows of it a millimetre in front, and a warning names it.
"""

from dataclasses import replace
from functools import cache, cached_property

import numpy as np

from ..core.parallel import slices
from ..core.progress import Progress
from ..core.ranges import unrolled
from ..core.sampling.streams import sobol
from ..core.sampling.vectors import dot, largest, rows
from ..core.sampling.warps import sample_uniform_triangle
from ..scene import Scene
from .flush_emitters import flush_emitters
from .protocol import Hits, Tracer

_STAGE = "Looking for surfaces in one place"
_CHUNK = 1 << 16
_MAX_TRIANGLES = 1 << 20  # looked at, the largest first
_N_LOOKS = 1 << 17
_FEW, _MOST_POINTS = 16, 256  # of a triangle
_ONE_PLACE = 2.0**-21
"""How far apart surfaces may be, over their coordinates: about what float32 cannot tell apart."""


class CoincidentSurfaces:
    """Finds where surfaces of a scene lie in one place.

    Triangles are paired by short rays through their middles and, in small scenes, more of their points. Where they meet
    anything, more points follow: of two faces that are cut along different diagonals each triangle lies on two.
    Whether a point of one lies on another is then exact.

    Attributes
    ----------
    flush_emitters : list of (int, int)
        Objects whose emission is as if they were in front, and those in the same place.
    """

    def __init__(self, scene: Scene, tracer: Tracer, progress: Progress) -> None:
        self._scene = scene
        first, second = self._pairs(tracer, progress)
        self.flush_emitters = flush_emitters(scene, tracer, first, second)

        # What emits has nothing in front
        front = scene.shines & ~scene.materials.see_through[scene.material_of_triangle]
        kept = front[second] | ~front[first]
        first, second = first[kept], second[kept]
        self._in_front, self._hidden = front, np.zeros(scene.n_triangles + 1, bool)  # one more for triangle −1
        self._hidden[first[front[second] & ~front[first]]] = True
        order = np.argsort(first, kind="stable")
        self._second = second[order]
        self._start = np.searchsorted(first[order], np.arange(scene.n_triangles + 2))

    @property
    def any(self) -> bool:
        return len(self._second) > 0

    @cached_property
    def _n_partners(self) -> np.ndarray:
        """Partners of each triangle, and none for triangle −1, (t + 1,)."""
        counts = np.diff(self._start)
        counts[-1] = 0
        return counts

    def bring_forward(self, hits: Hits, seen: np.ndarray) -> None:
        """Move hits to what emits where it lies in the place of what was hit.

        Parameters
        ----------
        seen : (o,) bool
            Objects that the rays see.
        """
        k = np.flatnonzero(self._hidden[hits.triangle])
        scene, at = self._scene, hits.where(k)
        point, partner = self._partners_at(at.triangle, at.u, at.v)
        front = np.flatnonzero(self._in_front[partner] & seen[scene.object_of_triangle[partner]])
        point, first = np.unique(point[front], return_index=True)
        at, triangle = at.where(point), partner[front[first]]
        u, v = scene.barycentrics(triangle, scene.points(at.triangle, at.u, at.v))
        hits.put(k[point], replace(at, triangle=triangle, u=u, v=v, normal=rows(scene.normals, triangle)))

    def smother(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Whether light can leave points of triangles past none of the surfaces there, (n,) bool; not for triangle −1.

        See-through surfaces smother nothing: `leave` says what they do.
        """
        smothered = np.zeros(len(triangle), bool)
        point, partner = self._partners_at(triangle, u, v)
        see_through = self._scene.materials.see_through[self._scene.material_of_triangle[partner]]
        smothered[point[~see_through]] = True
        return smothered

    def leave(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Share of light that passes the other surfaces where points of triangles are, (n, 3) float32."""
        scene = self._scene
        passes = np.ones((len(triangle), 3), np.float32)
        point, partner = self._partners_at(triangle, u, v)
        at = partner, *scene.barycentrics(partner, scene.points(triangle[point], u[point], v[point]))
        share = scene.look_up(scene.materials.tint, *at) * (1 - scene.look_up(scene.materials.coverage, *at))
        np.multiply.at(passes, point, share)
        return passes

    def following(
        self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray, first: np.ndarray, seen: np.ndarray
    ) -> np.ndarray:
        """The triangle in the same place that comes after each, (n,) int32: in the order of their numbers, round to
        those that a ray met `first` (n,); −1 after the last.

        Parameters
        ----------
        seen : (o,) bool
            Objects that count.
        """
        n = self._scene.n_triangles
        turns = np.zeros(len(triangle), np.int32)
        turns[:] = np.where(first == triangle, n, (first - triangle) % n)
        point, partner = self._partners_at(triangle, u, v)
        k = np.flatnonzero(seen[self._scene.object_of_triangle[partner]])
        np.minimum.at(turns, point[k], (partner[k] - triangle[point[k]]) % n)
        met = (triangle + turns) % n
        return np.where((triangle >= 0) & (met != first), met, -1).astype(np.int32)

    def _partners_at(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Other triangles that points of triangles (n,) lie on: index of the point and triangle of each, (p,) each."""
        k = np.flatnonzero(self._n_partners[triangle])
        if len(k) == 0:
            return np.zeros(0, np.int64), np.zeros(0, np.int32)
        x = self._scene.points(triangle[k], u[k], v[k])
        columns = np.ascontiguousarray(x.T)
        point, nth = unrolled(self._n_partners[triangle[k]])
        partner = self._start[triangle[k]][point] + nth

        # Of the many partners that a ground has, few are near
        low, high = self._bounds
        for axis in range(3):
            place = columns[axis][point]
            near = np.flatnonzero((place >= low[axis][partner]) & (place <= high[axis][partner]))
            point, partner = point[near], partner[near]
        partner = self._second[partner]
        on = np.flatnonzero(_inside(self._scene, partner, rows(x, point), triangle[k[point]]))
        return k[point[on]], partner[on]

    @cached_property
    def _bounds(self) -> np.ndarray:
        """Lowest and highest coordinates of the triangles `_second`, and a little more, (2, 3, p) float32."""
        corners = self._scene.corners(self._second).astype(np.float64).transpose(1, 2, 0)
        low, high = corners.min(axis=0), corners.max(axis=0)
        margin = 4 * _ONE_PLACE * np.maximum(np.abs(corners).max(axis=(0, 1), initial=0), 1e-6)
        return np.stack([low - margin, high + margin]).astype(np.float32)

    def _pairs(self, tracer: Tracer, progress: Progress) -> tuple[np.ndarray, np.ndarray]:
        """Triangles that lie in one place, each pair both ways round, (p,) int32 each."""
        scene = self._scene
        looked_at = np.arange(scene.n_triangles)
        if len(looked_at) > _MAX_TRIANGLES:
            looked_at = np.argpartition(-scene.areas, _MAX_TRIANGLES)[:_MAX_TRIANGLES]
        few = min(_places(looked_at), _FEW)
        near, met = _met_beside(scene, tracer, looked_at, _points_within()[:few], progress.part(0.0, 0.4))
        near = np.unique(near)
        _, more = _met_beside(scene, tracer, near, _points_within()[: _places(near)], progress.part(0.4, 0.8))

        # Of two surfaces a ray finds one, maybe that which it is sent through. Then the other's rays find it, unless
        # that is so large that they miss it: rays past the small one find the large one. What emits must be found.
        places = _points_around()
        shining = np.flatnonzero(scene.shines)[: _N_LOOKS // len(places)]
        _, around = _met_beside(scene, tracer, shining, places, progress.part(0.8, 1.0))
        found = np.concatenate([_overlapping(scene, np.concatenate([met, more])), _overlapping(scene, around)])
        both = np.unique(np.concatenate([found, found[:, ::-1]]).astype(np.int32), axis=0)
        return both[:, 0], both[:, 1]


def _places(triangles: np.ndarray) -> int:
    """At how many points each of so many triangles may be looked at."""
    return int(np.clip(_N_LOOKS // max(len(triangles), 1), 1, _MOST_POINTS))


@cache
def _points_within() -> np.ndarray:
    """Points of a triangle, (_MOST_POINTS, 2) float32: its middle and others."""
    others = np.stack(sample_uniform_triangle(sobol(2, 0).random(_MOST_POINTS).astype(np.float32)), axis=1)
    return np.concatenate([np.full((1, 2), 1 / 3, np.float32), others[:-1]])


def _points_around() -> np.ndarray:
    """Points of a triangle's plane outside of it, nearer and farther, (18, 2) float32."""
    corners = np.array([[0, 0], [1, 0], [0, 1]])
    reach = np.array([1.1, 2, 4, 8, 16, 32])[:, None, None]
    return (1 / 3 + reach * (corners - 1 / 3)).reshape(-1, 2).astype(np.float32)


def _met_beside(
    scene: Scene, tracer: Tracer, triangles: np.ndarray, places: np.ndarray, progress: Progress
) -> tuple[np.ndarray, np.ndarray]:
    """By short rays through some places (k, 2) of triangles: those that meet others, and pairs (p, 2) in one plane."""
    near, pairs = [np.zeros(0, np.int64)], [np.zeros((0, 2), np.int64)]
    for chunk in slices(len(triangles), _CHUNK // len(places)):
        progress.update(_STAGE, chunk.start / len(triangles))
        looked_at = np.repeat(triangles[chunk], len(places))
        u, v = np.tile(places.T, len(triangles[chunk]))
        x, normals = scene.points(looked_at, u, v), scene.normals[looked_at]
        gap = 4 * scene.ray_offset(looked_at, x)
        for side in (np.float32(1), np.float32(-1)):
            hits = tracer.closest_hit(x + side * gap * normals, -side * normals, 2 * gap[:, 0])
            k = np.flatnonzero(hits.hit & (hits.triangle != looked_at))
            other = hits.triangle[k]
            flat = np.abs(dot(scene.normals[other], normals[k])) > 1 - 1e-6
            near.append(looked_at[k])
            pairs.append(np.stack([looked_at[k], other], axis=1)[flat])
    return np.concatenate(near), np.concatenate(pairs)


def _overlapping(scene: Scene, pairs: np.ndarray) -> np.ndarray:
    """Those pairs (p, 2) of which some point of the smaller lies on the other, each once."""
    swapped = scene.areas[pairs[:, 0]] > scene.areas[pairs[:, 1]]
    pairs = np.unique(np.where(swapped[:, None], pairs[:, ::-1], pairs), axis=0)
    lie = [np.zeros(0, bool)]
    places = _points_within()[: max(_places(pairs), _FEW)]
    for chunk in slices(len(pairs), _CHUNK // len(places)):
        first, second = np.repeat(pairs[chunk], len(places), axis=0).T
        u, v = np.tile(places.T, len(pairs[chunk]))
        on = _inside(scene, second, scene.points(first, u, v), first)
        lie.append(on.reshape(-1, len(places)).any(axis=1))
    return pairs[np.concatenate(lie)]


def _inside(scene: Scene, triangle: np.ndarray, x: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Whether points (n, 3) of triangles `own` (n,) lie on triangles (n,), (n,) bool."""
    u, v = scene.plane_coordinates(triangle, x)
    above: np.ndarray = x - rows(scene.vertices, scene.triangles[triangle, 0]).astype(np.float64)
    height = np.abs(dot(above, rows(scene.normals, triangle).astype(np.float64)))
    # Points and normals are rounded by the size of the corners that they come from
    corners = [np.abs(scene.corners(of)).max(axis=(1, 2), initial=0) for of in (triangle, own)]
    rounding = _ONE_PLACE * largest(np.abs(x)) + _ONE_PLACE / 2 * np.maximum(*corners)
    return (height <= rounding) & (u >= 0) & (v >= 0) & (u + v <= 1)
