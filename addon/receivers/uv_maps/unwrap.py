"""Faces laid flat: connected faces that look one way are seen from there, and what lies over itself is cut apart.

Faces stay whole, since a UV map has one place for each corner of a face. A handful of directions is found for a mesh,
as Blender's Smart UV Project does: the mean normal of the faces around the largest one, then that of the faces around
the one that lies farthest from all directions so far, until none lies farther than `ANGLE`. The connected faces that
are nearest to one direction are a chart, which is projected along its own mean normal.

A chart that lies over itself (the turns of a spiral stair) is cut at half of its height above its plane, some times
over; after that only its lower sheet stays, and what lies above it becomes charts of their own. Each step is an
operation on all faces at once, and there are at most `ROUNDS` of them; faces that lie over others even then, or after
`SECONDS`, become a chart each.
"""

from collections.abc import Callable
from time import perf_counter

import numpy as np

from ...core.sampling.vectors import dot
from ..lightmap.charts import components
from .faces import Faces, areas
from .folds import Projection, faces_above
from .merging import merged
from .packing import Piece

ANGLE = float(np.radians(66))
"""Between a face and the direction that it is seen from, at most, if charts do not have to be cut; that of Blender's
Smart UV Project."""

ROUNDS, CUTS = 16, 6
"""Times that charts which lie over themselves are made smaller, and how often of these they are cut by height."""

SECONDS = 30.0
"""Time for a mesh, after which faces that lie over others become a chart each."""

_STEEP = 0.2  # cosine of the angle to a chart's mean normal up to which it is projected along it
_MOST_DIRECTIONS = 64


def unwrapped(faces: Faces, check: Callable[[], None] = lambda: None) -> Piece:
    """The charts of a mesh, of which none lies over itself, in metres.

    Their size is right on average; a face at an angle α to its chart's plane is smaller by cos α.

    Parameters
    ----------
    faces : Faces
        With vertices that repeat in a face, faces that repeat, and faces without an area, too.
    check : callable
        Raises an exception to end this early.
    """
    until = perf_counter() + SECONDS
    first, second = faces.neighbours()
    check()
    normals = _normals(faces)
    chart = merged(faces, _components_of(_directions(faces, check), first, second), first, second, check)
    doubtful = np.ones(len(faces), bool)
    for number in range(ROUNDS):
        check()
        seen = Projection.of(faces, chart, normals, _STEEP)
        above = faces_above(faces, seen, doubtful, check)
        if not above.any():
            break
        if number == ROUNDS - 1 or perf_counter() > until:
            chart[above] = chart.max() + 1 + np.arange(int(above.sum()))
            seen = Projection.of(faces, chart, normals, _STEEP)
            break
        doubtful = np.isin(chart, chart[above])
        part = _higher_half(seen, above) if number < CUTS else above
        chart = _components_of(chart * 2 + part, first, second)
    uv = seen.uv * np.float32(_middle_ratio(faces, seen))
    area = float(areas(uv[faces.triangles]).sum())
    border = np.flatnonzero(faces.border(chart))
    edges = np.stack([border, faces.following[border]], axis=1).astype(np.int32)
    return Piece(uv, chart[faces.face_of_corner], edges, area)


def _components_of(part: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Number of the connected faces of one part (f,) that each face is among, (f,) int32."""
    same = part[first] == part[second]
    return components(len(part), first[same], second[same])


def _normals(faces: Faces) -> np.ndarray:
    """Unit normals of faces, (f, 3) float64; 0 where there is none."""
    length = np.sqrt(dot(faces.vector_areas, faces.vector_areas))
    return faces.vector_areas / np.maximum(length, 1e-300)[:, None]


def _directions(faces: Faces, check: Callable[[], None]) -> np.ndarray:
    """The direction that each face is seen from, (f,) int64: the nearest of those that the mesh needs."""
    normals, area = _normals(faces), np.sqrt(dot(faces.vector_areas, faces.vector_areas))
    nearest, nearness = np.zeros(len(faces), np.int64), np.full(len(faces), -2.0)
    nearness[area <= 0] = 2  # they lie anywhere
    seed = int(np.argmax(area))
    for number in range(_MOST_DIRECTIONS):
        check()
        around = (normals @ normals[seed] > np.cos(ANGLE / 2)) & (nearness < np.cos(ANGLE / 2))
        mean = faces.vector_areas[around].sum(axis=0)
        mean = mean / np.linalg.norm(mean) if np.linalg.norm(mean) > 0 else normals[seed]
        near = normals @ mean
        better = near > nearness
        nearest[better], nearness[better] = number, near[better]
        seed = int(np.argmin(nearness))
        if nearness[seed] > np.cos(ANGLE):
            break
    return nearest


def _higher_half(seen: Projection, above: np.ndarray) -> np.ndarray:
    """Which faces lie in the higher half of a chart that has faces above others, (f,) bool."""
    n = int(seen.chart.max()) + 1
    low, high = np.full(n, np.inf), np.full(n, -np.inf)
    np.minimum.at(low, seen.chart, seen.height)
    np.maximum.at(high, seen.chart, seen.height)
    folded = np.zeros(n, bool)
    folded[seen.chart[above]] = True
    return folded[seen.chart] & (seen.height > ((low + high) / 2)[seen.chart])


def _middle_ratio(faces: Faces, seen: Projection) -> float:
    """Metres of surface a metre of UV, such that half of the surface has more; 1 where nothing has an area."""
    in_space = np.sqrt(dot(faces.vector_areas, faces.vector_areas))
    ratio = 1 / np.sqrt(np.maximum(seen.cosine, 0.05))
    order = np.argsort(ratio)
    share = np.cumsum(in_space[order])
    if not share.size or not share[-1] > 0:
        return 1.0
    return float(ratio[order[np.searchsorted(share, share[-1] / 2)]])
