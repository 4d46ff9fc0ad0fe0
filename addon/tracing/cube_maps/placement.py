"""Where cube maps stand."""

import numpy as np

from ...core.parallel import Workers
from ...core.sampling.streams import stream
from ...core.sampling.vectors import dot
from ...scene import Scene
from ..protocol import Tracer
from .search.segments import LightRays, LitSides, lit_sides, surface_rays
from .stage import each

_STREAM = 52
_GRID = 8  # candidates along each side of the region
_N_FACING = 300  # candidates before surfaces
_FARTHEST = 1 / 8  # of the region's diagonal, from their surface
_FINE = 1 / 20  # of the region's diagonal: texels that cover less of a surface are worth more than half of the finest
_INSIDE = 0.75  # weight of what lies in the region


def lit_region(points: np.ndarray) -> np.ndarray:
    """The box around the middle 96 % of points (n, 3) along each axis, (2, 3) float32, m.

    Of receivers, or of photons: a ground plane's corners far away do not blow it up.
    """
    return np.percentile(points, [2, 98], axis=0).astype(np.float32)


def regular(region: np.ndarray, n_maps: int) -> np.ndarray:
    """Middles of the cells of a cubic grid over a region (2, 3), or of n_maps of them spread evenly, (n_maps, 3)."""
    side = int(np.ceil(round(n_maps ** (1 / 3), 6)))
    cells = np.linspace(0, side**3 - 1, n_maps).round().astype(np.int64)
    place = (np.stack(np.unravel_index(cells, (side, side, side)), axis=1) + 0.5) / side
    return (region[0] + place * (region[1] - region[0])).astype(np.float32)


def placed(
    scene: Scene,
    tracer: Tracer,
    region: np.ndarray,
    n_maps: int,
    size: int,
    workers: Workers,
    light: LightRays | None = None,
) -> np.ndarray:
    """Places from which maps of faces of size² see most of what light meets, (n_maps, 3) float32.

    One after the other, out of some hundred candidates all over the region and before surfaces, that place is taken
    which adds most to what the sides are worth in the map that shows them best: half for being seen at all, and half
    for being seen finely. Maps in walls see nothing that light meets, and drop out.

    See `MultiImageTracer.build` for the parameters.
    """
    random = stream(workers.seed, _STREAM)
    sides = lit_sides(scene, tracer, light or surface_rays(scene, region, random), random)
    if len(sides.positions) == 0:
        return regular(region, n_maps)
    inside = ((sides.positions >= region[0]) & (sides.positions <= region[1])).all(axis=1)
    candidates = _candidates(scene, tracer, region, sides, inside, random)
    fine = np.linalg.norm(region[1] - region[0]) * _FINE

    def score(place: np.ndarray) -> np.ndarray:
        # Texels a surface area, over that of texels that cover fine²
        density = seen_solid_angle(tracer, place, sides) * (size * fine / 2) ** 2
        return 0.5 * (density > 0) + 0.5 * density / (1 + density)

    scores = np.stack(list(each(workers, score, list(candidates))))
    weights = np.where(inside, _INSIDE / max(inside.sum(), 1), (1 - _INSIDE) / max((~inside).sum(), 1))
    best, chosen = np.zeros(len(weights)), []
    for _ in range(n_maps):
        chosen.append(int((np.maximum(scores - best, 0) @ weights).argmax()))
        best = np.maximum(best, scores[chosen[-1]])
    return candidates[chosen]


def seen_solid_angle(tracer: Tracer, place: np.ndarray, sides: LitSides) -> np.ndarray:
    """Solid angle cos θ/d² for each area of sides (n) as a place (3,) sees them, (n,) float32, sr/m²; 0 if hidden."""
    way = place - sides.positions
    d2 = np.maximum(dot(way, way), np.float32(1e-20))
    angle = dot(way, sides.normals) / (d2 * np.sqrt(d2))
    faces = np.flatnonzero(angle > 0)
    hidden = tracer.occluded(np.tile(place, (len(faces), 1)), sides.positions[faces])
    seen = np.zeros(len(angle), np.float32)
    seen[faces[~hidden]] = angle[faces[~hidden]]
    return seen


def _candidates(
    scene: Scene, tracer: Tracer, region: np.ndarray, sides: LitSides, inside: np.ndarray, random: np.random.Generator
) -> np.ndarray:
    """Places all over the region, and up to half way from sides to what they face, (n, 3) float32."""
    cells = np.stack(np.unravel_index(np.arange(_GRID**3), (_GRID,) * 3), axis=1)
    spread = region[0] + (cells + random.random(cells.shape)) / _GRID * (region[1] - region[0])
    diagonal = np.linalg.norm(region[1] - region[0])
    pool = np.flatnonzero(inside) if inside.any() else np.arange(len(inside))
    k = random.choice(pool, _N_FACING)
    positions, normals = sides.positions[k], sides.normals[k]
    room = np.minimum(tracer.closest_hit(positions, normals).distance / 2, _FARTHEST * diagonal)
    facing = positions + (room * random.uniform(0.3, 1, len(k)))[:, None] * normals
    return np.concatenate([spread, facing]).astype(np.float32)
