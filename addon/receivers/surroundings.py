"""What lies around the points of texels: other surfaces close by, or a solid that they are inside of."""

from dataclasses import dataclass

import numpy as np

from ..parallel import Workers, slices
from ..sampling.vectors import dot
from ..tracers import Tracer
from .texel_points import TexelPoints

_CHUNK = 1 << 15  # points
_MOST = 3  # of the four rays along the surface that have to see backs, besides the one upwards
_BENT = np.float32(np.cos(np.radians(45)))  # what bends less is the surface's own curve


@dataclass(frozen=True)
class Surroundings:
    """What n points have around them.

    Attributes
    ----------
    near : (n,) bool
        Another surface stands within reach of the point's texel.
    inside : (n,) bool
        The point is inside of something solid: rays from it see the backs of surfaces.
    way_out : (n, 3) float32, m
        From points inside to the nearest place outside that is within reach; 0 where there is none.
    """

    near: np.ndarray
    inside: np.ndarray
    way_out: np.ndarray


def look_around(points: TexelPoints, tracer: Tracer, workers: Workers, stage: str) -> Surroundings:
    """What is around points: by a ray along the normal, and four along the surface to the corners of the texel.

    Any wall that crosses a texel stands between its middle and one of its corners.
    """

    def look(chunk: slice) -> Surroundings:
        return _look(points.where(np.arange(chunk.start, chunk.stop)), tracer)

    empty = Surroundings(np.zeros(0, bool), np.zeros(0, bool), np.zeros((0, 3), np.float32))
    parts = [empty]
    workers.progress.update(stage, 0)
    for part in workers.map(look, slices(len(points), _CHUNK)):
        parts.append(part)
        workers.progress.update(stage, (len(parts) - 1) * _CHUNK / max(len(points), _CHUNK))
    return Surroundings(*(np.concatenate([getattr(part, name) for part in parts]) for name in vars(empty)))


def _look(points: TexelPoints, tracer: Tracer) -> Surroundings:
    n = len(points)
    upwards = tracer.closest_hit(points.position, points.normal)
    near, n_backs = np.zeros(n, bool), np.zeros(n, np.int8)
    nearest, way_out = np.full(n, np.inf, np.float32), np.zeros((n, 3), np.float32)
    for u, v in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
        way = (np.float32(u) * points.across[:, 0] + np.float32(v) * points.across[:, 1]) / 2
        reach = np.sqrt(dot(way, way))
        direction = way / np.maximum(reach, np.float32(1e-30))[:, None]
        hits = tracer.closest_hit(points.position, direction)
        back = hits.hit & hits.back(direction)
        facing = dot(np.where(back[:, None], -hits.normal, hits.normal), points.normal)
        within = hits.distance < reach
        near |= within & (facing < _BENT)
        n_backs += back
        better = back & within & (hits.distance < nearest)
        nearest[better] = hits.distance[better]
        beyond = hits.distance + np.float32(0.01) * reach
        way_out[better] = beyond[better, None] * direction[better]
    inside = upwards.hit & upwards.back(points.normal) & (n_backs >= _MOST)
    return Surroundings(near, inside, np.where(inside[:, None], way_out, 0))
