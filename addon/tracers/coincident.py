"""Surfaces that lie in one and the same place, as walls do that were modelled twice.

There Cycles is dark: a ray that leaves one of the two surfaces meets the other at once, so neither light nor looks get
away. What a scene means is what Cycles makes of it; a tracer that steps off the surface would make such walls bright.
"""

from collections.abc import Iterator
from functools import cached_property

import numpy as np

from ..parallel import slices
from ..progress import Progress
from ..sampling.streams import sobol
from ..sampling.vectors import dot, largest, rows
from ..sampling.warps import sample_uniform_triangle
from ..scene import Scene
from ..unrolling import unrolled
from .protocol import Tracer

_STAGE = "Looking for surfaces in one place"
_CHUNK = 1 << 16
_MAX_TRIANGLES = 1 << 20  # looked at, the largest first
_MOST_POINTS = 16  # of a triangle
_N_LOOKS = 1 << 17
_ONE_PLACE = 2.0**-21
"""How far apart surfaces may be, over their coordinates: about what float32 cannot tell apart."""


class CoincidentSurfaces:
    """Finds where surfaces of a scene lie in one place.

    Triangles are paired by short rays through their middles and, in small scenes, more of their points. Where they meet
    anything, more points follow: of two faces that are cut along different diagonals each triangle lies on two.
    Whether a point of one lies on another is then exact.
    """

    def __init__(self, scene: Scene, tracer: Tracer, progress: Progress) -> None:
        self._scene = scene
        first, second = self._pairs(tracer, progress)
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
        on = np.flatnonzero(_inside(self._scene, partner, rows(x, point)))
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
        n_points = int(np.clip(_N_LOOKS // max(len(looked_at), 1), 1, _MOST_POINTS))
        near, pairs = _found_beside(scene, tracer, looked_at, n_points, progress.part(0.0, 0.5))
        _, more = _found_beside(scene, tracer, np.unique(near), _MOST_POINTS, progress.part(0.5, 1.0))
        found = np.concatenate([pairs, more]).astype(np.int32)
        both = np.unique(np.concatenate([found, found[:, ::-1]]), axis=0)
        return both[:, 0], both[:, 1]


def _found_beside(
    scene: Scene, tracer: Tracer, triangles: np.ndarray, n_points: int, progress: Progress
) -> tuple[np.ndarray, np.ndarray]:
    """Of triangles those beside which others are at some of so many points, and the pairs (p, 2) in one place."""
    near, pairs = [np.zeros(0, np.int64)], [np.zeros((0, 2), np.int64)]
    for chunk in slices(len(triangles), _CHUNK // n_points):
        progress.update(_STAGE, chunk.start / len(triangles))
        for of_side, in_place in _met_beside(scene, tracer, triangles[chunk], n_points):
            near.append(of_side)
            pairs.append(in_place)
    return np.concatenate(near), np.concatenate(pairs)


def _met_beside(
    scene: Scene, tracer: Tracer, triangles: np.ndarray, n_points: int
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """By rays from either side: triangles that meet others at some of so many points, and pairs in one place there."""
    looked_at = np.repeat(triangles, n_points)
    others = sample_uniform_triangle(sobol(2, 0).random(_MOST_POINTS).astype(np.float32))
    u, v = (np.tile(np.append(np.float32(1 / 3), place)[:n_points], len(triangles)) for place in others)
    x, normals = scene.points(looked_at, u, v), scene.normals[looked_at]
    gap = 4 * scene.ray_offset(looked_at, x)
    for side in (np.float32(1), np.float32(-1)):
        hits = tracer.closest_hit(x + side * gap * normals, -side * normals, 2 * gap[:, 0])
        k = np.flatnonzero(hits.hit & (hits.triangle != looked_at))
        other = hits.triangle[k]
        flat = np.abs(dot(scene.normals[other], normals[k])) > 1 - 1e-6
        k, other = k[flat], other[flat]
        on = _inside(scene, other, x[k])
        yield looked_at[k], np.stack([looked_at[k[on]], other[on]], axis=1)


def _inside(scene: Scene, triangle: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Whether points (n, 3) lie on triangles (n,), (n,) bool."""
    u, v = scene.plane_coordinates(triangle, x)
    above: np.ndarray = x - rows(scene.vertices, scene.triangles[triangle, 0]).astype(np.float64)
    height = np.abs(dot(above, rows(scene.normals, triangle).astype(np.float64)))
    near = height <= _ONE_PLACE * np.maximum(largest(np.abs(x)), 1e-6)
    return near & (u >= 0) & (v >= 0) & (u + v <= 1)
