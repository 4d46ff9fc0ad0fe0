"""Surfaces that lie in one and the same place, as walls do that were modelled twice.

There a ray that leaves one of the two surfaces meets the other at once, so neither light nor looks get away: Cycles is
dark, but where rounding puts points in front of the other surface, which a tracer that steps off the surface would do
everywhere. `coplanar` says of which points.

Where one of the two emits, what Cycles shows depends on which of them its tree of boxes finds first, and on rounding:
one and the same panel in a wall gave 0.02 to 0.13, by the order of the objects, the diagonals and the walls' tilt. Here
it counts as lying in front, which gives what Cycles shows of it a millimetre in front, and a warning names it.
"""

from functools import cache, cached_property

import numpy as np

from ..core.compiling import kernel
from ..core.parallel import slices
from ..core.progress import Progress
from ..core.sampling.sobol import fixed_points
from ..core.sampling.warps import sample_uniform_triangle
from ..core.vec3 import along, dot, row, times
from ..scene import RayKind, Scene
from ..scene.hit import point_at, ray_offset
from .coplanar import ONE_PLACE, CoincidentArrays, lies_on
from .embree import EmbreeTracer, intersect, new_ray
from .flush_emitters import flush_emitters

_STAGE = "Looking for surfaces in one place"
_CHUNK = 1 << 16
_MAX_TRIANGLES = 1 << 20  # looked at, the largest first
_N_LOOKS = 1 << 19
_FEW, _MOST_POINTS = 16, 256  # of a triangle
_FLAT = np.float32(1 - 1e-6)


class CoincidentSurfaces:
    """Finds where surfaces of a scene lie in one place.

    Triangles are paired by short rays through their middles and, the larger they are, more of their points: of two
    walls that overlap in part neither's middle may lie on the other, and of two surfaces a ray finds one, maybe that
    which it is sent through. Where they meet anything, more points follow: of two faces that are cut along different
    diagonals each triangle lies on two. Whether a point of one lies on another is then exact.

    Attributes
    ----------
    flush_emitters : list of (int, int)
        Objects whose emission is as if they were in front, and those in the same place.
    """

    def __init__(self, scene: Scene, tracer: EmbreeTracer, progress: Progress) -> None:
        self._scene = scene
        first, second = self._pairs(tracer, progress)
        self.flush_emitters = flush_emitters(scene, tracer, first, second)

        # What emits has nothing in front
        front = scene.shines & ~scene.materials.see_through[scene.material_of_triangle]
        kept = front[second] | ~front[first]
        first, second = first[kept], second[kept]
        self._in_front, self._hidden = front, np.zeros(scene.n_triangles, bool)
        self._hidden[first[front[second] & ~front[first]]] = True
        order = np.argsort(first, kind="stable")
        self._second = second[order]
        self._start = np.searchsorted(first[order], np.arange(scene.n_triangles + 1))

    @cached_property
    def arrays(self) -> CoincidentArrays:
        """What kernels take."""
        low, high = self._bounds()
        shares = np.diff(self._start) > 0
        return CoincidentArrays(
            bool(shares.any()), shares, self._start, self._second, low, high, self._in_front, self._hidden
        )

    def _bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest coordinates of the triangles `_second`, and a little more, (p, 3) float32 each."""
        corners = self._scene.corners(self._second).astype(np.float64)
        margin = 4 * ONE_PLACE * np.maximum(np.abs(corners).max(axis=(1, 2), initial=0), 1e-6)[:, None]
        low, high = corners.min(axis=1) - margin, corners.max(axis=1) + margin
        return low.astype(np.float32), high.astype(np.float32)

    def _pairs(self, tracer: EmbreeTracer, progress: Progress) -> tuple[np.ndarray, np.ndarray]:
        """Triangles that lie in one place, each pair both ways round, (p,) int32 each."""
        scene = self._scene
        looked_at = np.arange(scene.n_triangles)
        if len(looked_at) > _MAX_TRIANGLES:
            looked_at = np.argpartition(-scene.areas, _MAX_TRIANGLES)[:_MAX_TRIANGLES]
        by_area = _looks(looked_at, _n_by_area(scene.areas[looked_at]), _points_within())
        near, met = _met_beside(scene, tracer, *by_area, progress.part(0.0, 0.4))
        near = np.unique(near)
        _, more = _met_beside(
            scene, tracer, *_looks(near, _n_even(len(near)), _points_within()), progress.part(0.4, 0.7)
        )

        # Rays through a small surface may all find itself, and those of a large one miss it: rays past the small one
        # find the large one. What emits must be found.
        places = _points_around()
        shining = np.flatnonzero(scene.shines)[: _N_LOOKS // len(places)]
        past = _looks(shining, len(places), places)
        _, around = _met_beside(scene, tracer, *past, progress.part(0.7, 0.8))
        parts = [
            _overlapping(scene, np.concatenate([met, more]), progress.part(0.8, 0.9)),
            _overlapping(scene, around, progress.part(0.9, 1.0)),
        ]
        found = np.concatenate(parts)
        both = np.unique(np.concatenate([found, found[:, ::-1]]).astype(np.int32), axis=0)
        return both[:, 0], both[:, 1]


def _n_by_area(areas: np.ndarray) -> np.ndarray:
    """At how many points each of n triangles is looked at, (n,) int64: about `_N_LOOKS` in all, as their areas are."""
    share = areas / max(areas.sum(dtype=np.float64), 1e-30)
    return np.clip(np.ceil(share * _N_LOOKS), 1, _MOST_POINTS).astype(np.int64)


def _n_even(n: int) -> int:
    """At how many points each of n triangles, or pairs of them, is looked at if all are at as many."""
    return int(np.clip(_N_LOOKS // max(n, 1), 1, _MOST_POINTS))


def _looks(triangles: np.ndarray, n_looks: np.ndarray | int, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles, each as often as it is looked at, and the first of some places (k, 2) for each, (l,) and (l, 2)."""
    n_looks = np.broadcast_to(n_looks, len(triangles))
    first = np.cumsum(n_looks) - n_looks
    number = np.arange(n_looks.sum()) - np.repeat(first, n_looks)
    return np.repeat(triangles, n_looks), places[number]


@cache
def _points_within() -> np.ndarray:
    """Points of a triangle, (_MOST_POINTS, 2) float32: its middle and others."""
    others = np.stack(sample_uniform_triangle(fixed_points(_MOST_POINTS)), axis=1)
    return np.concatenate([np.full((1, 2), 1 / 3, np.float32), others[:-1]])


def _points_around() -> np.ndarray:
    """Points of a triangle's plane outside of it, nearer and farther, (18, 2) float32."""
    corners = np.array([[0, 0], [1, 0], [0, 1]])
    reach = np.array([1.1, 2, 4, 8, 16, 32])[:, None, None]
    return (1 / 3 + reach * (corners - 1 / 3)).reshape(-1, 2).astype(np.float32)


def _met_beside(
    scene: Scene, tracer: EmbreeTracer, triangles: np.ndarray, places: np.ndarray, progress: Progress
) -> tuple[np.ndarray, np.ndarray]:
    """By short rays through places (l, 2) of triangles (l,): those that meet others, and pairs (p, 2) in one plane."""
    near, pairs = [np.zeros(0, np.int64)], [np.zeros((0, 2), np.int64)]
    for chunk in slices(len(triangles), _CHUNK):
        progress.update(_STAGE, chunk.start / len(triangles))
        looked_at = triangles[chunk].astype(np.int64)
        others, meets = np.empty((len(looked_at), 2), np.int32), np.zeros(len(looked_at), bool)
        tree = tracer.handles[RayKind.DIFFUSE]
        _look_beside(scene.arrays, tree, new_ray(), looked_at, np.ascontiguousarray(places[chunk]), others, meets)
        near.append(looked_at[meets])
        k, side = np.nonzero(others >= 0)
        pairs.append(np.stack([looked_at[k], others[k, side]], axis=1))
    return np.concatenate(near), np.concatenate(pairs)


@kernel
def _look_beside(scene, tree, room, triangles, places, others, meets):
    """Short rays through places (l, 2) of triangles (l,), from both sides: the others (l, 2) in one plane that they
    meet, −1 for none, and whether they meet any (l,).
    """
    for i in range(len(triangles)):
        triangle = triangles[i]
        normal = row(scene.normals, triangle)
        x = point_at(scene, triangle, places[i, 0], places[i, 1])
        gap = np.float32(4) * ray_offset(scene, triangle, x)
        for side in range(2):
            outwards = times(normal, np.float32(1 - 2 * side))
            start, inwards = along(x, gap, outwards), times(outwards, np.float32(-1))
            met = intersect(tree, room, start, inwards, np.float32(2) * gap)[0]
            others[i, side] = -1
            if met >= 0 and met != triangle:
                meets[i] = True
                if abs(dot(row(scene.normals, met), normal)) > _FLAT:
                    others[i, side] = met


def _overlapping(scene: Scene, pairs: np.ndarray, progress: Progress) -> np.ndarray:
    """Those pairs (p, 2) of which some point of the smaller lies on the other, each once."""
    swapped = scene.areas[pairs[:, 0]] > scene.areas[pairs[:, 1]]
    pairs = np.unique(np.where(swapped[:, None], pairs[:, ::-1], pairs), axis=0)
    overlap = np.zeros(len(pairs), bool)
    places = _points_within()[: max(_n_even(len(pairs)), _FEW)]
    for chunk in slices(len(pairs), _CHUNK // len(places)):
        progress.update(_STAGE, chunk.start / len(pairs))
        _overlap(scene.arrays, pairs[chunk], places, overlap[chunk])
    return pairs[overlap]


@kernel
def _overlap(scene, pairs, places, overlap):
    """Whether one of the places (k, 2) of the first triangles of pairs (p, 2) lies on the second, (p,)."""
    for i in range(len(pairs)):
        first, second = pairs[i, 0], pairs[i, 1]
        for j in range(len(places)):
            if lies_on(scene, second, point_at(scene, first, places[j, 0], places[j, 1]), first):
                overlap[i] = True
                break
