"""What lies around the points of texels: other surfaces close by, or a solid that they are inside of."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...core.parallel import Workers
from ...core.sampling.vectors import dot
from ...tracing import Hits, Tracer
from .texel_points import TexelPoints

_CHUNK = 1 << 15  # points
_MOST = 3  # of the four rays along the surface that have to see backs, besides the one upwards
_BENT = np.float32(np.cos(np.radians(45)))  # what bends less is the surface's own curve
_BEYOND = 0.01  # texels, behind the surface that a point is moved through

_CORNERS = ((-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5))
_NEIGHBOURS = tuple((float(u), float(v)) for u in (-1, 0, 1) for v in (-1, 0, 1) if u or v)


@dataclass(frozen=True)
class Surroundings:
    """What n points have around them.

    Attributes
    ----------
    near : (n,) bool
        Another surface stands within reach of the point's texel.
    inside : (n,) bool
        The point is inside of something solid: rays from it see the backs of surfaces.
    """

    near: np.ndarray
    inside: np.ndarray


STAGE = "Placing texels"


def look_around(points: TexelPoints, tracer: Tracer, workers: Workers) -> Surroundings:
    """What is around points: by a ray along the normal, and four along the surface to the corners of the texel.

    Any wall that crosses a texel stands between its middle and one of its corners.
    """

    def look(part: TexelPoints) -> np.ndarray:
        upwards = tracer.closest_hit(part.position, part.normal)
        doubtful = upwards.hit & upwards.back(part.normal)
        near, n_backs = np.zeros(len(part), bool), np.zeros(len(part), np.int8)
        for step in _CORNERS:
            hits, back, share = _along(part, step, tracer, doubtful)
            facing = dot(np.where(back[:, None], -hits.normal, hits.normal), part.normal)
            near |= (share < 1) & (facing < _BENT)
            n_backs += back
        return np.stack([near, doubtful & (n_backs >= _MOST)], axis=1)

    near, inside = _of_chunks(look, points, np.zeros((0, 2), bool), workers).T
    return Surroundings(near, inside)


def ways_out(points: TexelPoints, tracer: Tracer, workers: Workers) -> np.ndarray:
    """From points inside of solids to the nearest place outside, no farther than the texels beside theirs, (n, 2).

    In texels, to the columns and to the rows; 0 where there is none.
    """

    def look(part: TexelPoints) -> np.ndarray:
        nearest, way_out = np.full(len(part), np.inf, np.float32), np.zeros((len(part), 2), np.float32)
        for step in _NEIGHBOURS:
            hits, back, share = _along(part, step, tracer, np.zeros(len(part), bool))
            better = np.flatnonzero(back & (share < 1) & (hits.distance < nearest))
            nearest[better] = hits.distance[better]
            way_out[better] = (share[better, None] + np.float32(_BEYOND)) * np.array(step, np.float32)
        return way_out

    return _of_chunks(look, points, np.zeros((0, 2), np.float32), workers)


def _along(
    points: TexelPoints, step: tuple[float, float], tracer: Tracer, far: np.ndarray
) -> tuple[Hits, np.ndarray, np.ndarray]:
    """What rays along the surface meet: the hits, whether from the back, and where along a step in texels.

    Those of some points (n,) bool look as far as there is anything, and others no farther than the step.
    """
    way = np.float32(step[0]) * points.across[:, 0] + np.float32(step[1]) * points.across[:, 1]
    reach = np.maximum(np.sqrt(dot(way, way)), np.float32(1e-30))
    direction = way / reach[:, None]
    hits = tracer.closest_hit(points.position, direction, np.where(far, np.float32(np.inf), reach))
    return hits, hits.hit & hits.back(direction), hits.distance / reach


def _of_chunks(
    look: Callable[[TexelPoints], np.ndarray], points: TexelPoints, empty: np.ndarray, workers: Workers
) -> np.ndarray:
    """What `look` makes of the points, chunk by chunk."""
    parts = workers.chunks(STAGE, len(points), _CHUNK, lambda chunk, _: look(points.where(chunk)), key=())
    return np.concatenate([empty, *(part for _, part in parts)])
