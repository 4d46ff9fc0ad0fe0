"""Sides of surface elements: direct light on them, and means of what they are over their area."""

from dataclasses import dataclass

import numpy as np

from ...bsdf.albedos import received_by_body, total_weight, weight_received
from ...bsdf.closure import bsdf_at, seen_from_behind
from ...bsdf.mixture import DIFFUSE, SUBSURFACE, TRANSLUCENT
from ...bsdf.scatter import lit_normal
from ...core.compiling import kernel, part
from ...core.parallel import Workers
from ...core.sampling.path_numbers import path_key, two_numbers
from ...core.sampling.warps import cosine_hemisphere
from ...core.vec3 import ONE, ZERO, dot, mul, negative, plus, row, times, to_world
from ...scene import RayKind, Scene
from ...scene.hit import hit_at, look_up, off_surface
from ...tracing import TransparencyTracer
from ...tracing.coplanar import coplanar_occluded
from ...tracing.embree import new_ray
from ...tracing.transparency import closest_hit
from ..direct.direct_light import DirectLight
from ..direct.visible import arriving
from .elements import SurfaceElements, point_on
from .hidden_sides import HiddenSides, is_hidden

_DIRECT = 12  # stream of random numbers
_N_LOOK, _N_SEEN, _N_UNSEEN, _MOST = 4, 12, 2, 4096  # points of a side
_LEAST_COVERAGE = np.float32(1e-3)  # where samples met nothing but holes
_CHUNK = 1 << 14
_PER_PI = np.float32(1 / np.pi)
_DIFFUSE = int(RayKind.DIFFUSE)
_N_COLUMNS = 14  # and 3 more where light walks in bodies


@dataclass(frozen=True)
class LitSides:
    """What direct light makes of the sides of elements, and means over their surface, rows 2 e.

    Attributes
    ----------
    radiance : (2 e, 3) float32, W/(m² sr)
        That direct light on this side and on the other makes.
    albedo, translucence : (2 e, 3) float32
        Of what is stopped.
    coverage : (2 e,) float32
        Share of the light that is stopped.
    arriving : (2 e, 3) float32, W/(m² sr)
        E/π of direct light, of what is stopped; (2 e, 0) where light walks in no body.
    """

    radiance: np.ndarray
    albedo: np.ndarray
    translucence: np.ndarray
    coverage: np.ndarray
    arriving: np.ndarray

    def with_direct(self, incident: np.ndarray) -> np.ndarray:
        """All that comes to sides, by that of it which is not direct (2 e, 3); (0, 3) without `arriving`."""
        return incident + self.arriving if self.arriving.size else np.zeros((0, 3), np.float32)

    def gathering(self, gathered: np.ndarray) -> np.ndarray:
        """What sides make of mean radiance (2 e, 3) that they gather, and of what those behind them gather."""
        return self.albedo * gathered + self.translucence * _swapped(gathered)


def lit_sides(
    scene: Scene,
    tracer: TransparencyTracer,
    direct: DirectLight,
    elements: SurfaceElements,
    seen: np.ndarray,
    hidden: HiddenSides,
    workers: Workers,
) -> LitSides:
    """Mean of ρE/π of direct light over points of each side, and what is to be known of the sides besides.

    Half of the points go to all sides evenly, half by the spread that a first look finds (Neyman's allocation): beside
    a lamp the light of an element is that of a small spot on it. What the first look found is not used again, since
    elements in which it missed the light get fewer points than others.

    Parameters
    ----------
    seen : (2 e,) bool
        Sides whose light may get to the receivers.
    """
    at = scene, tracer, direct, elements, hidden
    n_look = np.where(seen, _N_LOOK, 1)
    look = _sums_over_points(*at, n_look, workers, (_DIRECT, 0))
    spread = np.sqrt(np.maximum(look[:, 13] / n_look - (look[:, :3].sum(axis=1) / n_look) ** 2, 0)) * seen
    even = np.where(seen, _N_SEEN, _N_UNSEEN) // 2
    counts = even + np.minimum(even.sum() * spread / max(float(spread.sum()), 1e-30), _MOST).astype(np.int64)
    sums = _sums_over_points(*at, counts, workers, (_DIRECT, 1))
    weight = sums[:, 12:13]
    reflected, transmitted, albedo, through = (sums[:, i : i + 3] / weight for i in range(0, 12, 3))
    # Of an element that is nearly all hole the share is not known well: photons on the rest must not count for too much
    coverage = np.maximum(weight[:, 0] / counts, 1 / counts)
    columns = (reflected + _swapped(transmitted), albedo, through, coverage, sums[:, _N_COLUMNS:] / weight)
    return LitSides(*(column.astype(np.float32) for column in columns))


def _swapped(of_sides: np.ndarray) -> np.ndarray:
    """Values (2 e, …) of each side's other side."""
    return of_sides.reshape(-1, 2, *of_sides.shape[1:])[:, ::-1].reshape(of_sides.shape)


def _sums_over_points(
    scene: Scene,
    tracer: TransparencyTracer,
    direct: DirectLight,
    elements: SurfaceElements,
    hidden: HiddenSides,
    counts: np.ndarray,
    workers: Workers,
    key: tuple[int, int],
) -> np.ndarray:
    """Sums over `counts` (2 e,) random points of each side, (2 e, 14 or 17) float64.

    Columns: ρE/π, τE/π as seen from behind, ρ and τ in colours, each times the coverage, the coverage, and the square
    of the sum of the first three, with what bodies take; where light walks in bodies E/π, too.
    """
    first = np.concatenate([[0], np.cumsum(counts)])
    n_columns = _N_COLUMNS + 3 * bool(scene.materials.subsurface.any())
    sums, seed = np.zeros((len(counts), n_columns)), path_key(workers.seed, *key)
    hidden_sides = hidden.of_object if hidden.any else np.zeros(0, bool)
    at = tracer.arrays, direct.arrays, elements.arrays, hidden_sides

    def light(chunk: slice, _: np.random.Generator) -> None:
        start, end = np.searchsorted(first, [chunk.start, chunk.stop])  # sides whose first points are in the chunk
        _light_points(*at, new_ray(), seed, int(start), int(end), first, sums)

    part = (0.5 * key[1], 0.5 * (key[1] + 1))
    for _ in workers.chunks("Lighting surfaces", int(first[-1]), _CHUNK, light, key, part):
        pass
    return sums


@part
def point_of_side(scene, elements, side, key, path, i):
    """A random point of a side of an element, as a `Hit`, by two pairs of a path's numbers from the i-th."""
    a, b = two_numbers(key, path, i)
    choice, _ = two_numbers(key, path, i + 1)
    triangle, u, v = point_on(elements, side // 2, a, b, choice)
    towards = row(scene.normals, triangle)
    if side % 2 == 0:
        towards = negative(towards)
    return hit_at(scene, towards, triangle, ZERO, u, v)


@kernel
def _light_points(tracing, direct, elements, hidden, room, key, start, end, first, sums):
    """Add the points of sides `start` to `end` to their sums; the first of each has the number `first` of the side."""
    scene = tracing.scene
    for side in range(start, end):
        for path in range(first[side], first[side + 1]):
            hit = point_of_side(scene, elements, side, key, path, 0)
            bsdf, origin = bsdf_at(scene, hit, _DIFFUSE), off_surface(scene, hit, ONE)
            albedo, through = total_weight(scene, bsdf, DIFFUSE), total_weight(scene, bsdf, TRANSLUCENT)
            coverage = look_up(scene, scene.materials.coverage, hit.triangle, hit.u, hit.v, hit.back, _DIFFUSE)[0]
            inside = _is_inside(tracing, room, hidden, origin, hit.normal, key, path)
            if inside or coplanar_occluded(tracing, hit):
                coverage = ZERO
            coverage = max(coverage, _LEAST_COVERAGE)
            at = origin, lit_normal(scene, hit), scene.object[hit.triangle]
            arrived = arriving(direct, tracing, room, *at, key, path, 3, False)
            reflected = _taken(scene, bsdf, DIFFUSE, arrived, _PER_PI * coverage)
            behind = seen_from_behind(scene, bsdf, _DIFFUSE)
            _add_columns(sums, side, 0, reflected)
            _add_columns(sums, side, 3, _taken(scene, behind, TRANSLUCENT, arrived, _PER_PI * coverage))
            _add_columns(sums, side, 6, times(albedo, coverage))
            _add_columns(sums, side, 9, times(through, coverage))
            sums[side, 12] += coverage
            if sums.shape[1] > _N_COLUMNS:
                light = _entering(scene, bsdf, arrived, _PER_PI * coverage)
                _add_columns(sums, side, _N_COLUMNS, light)
                reflected = plus(reflected, mul(total_weight(scene, bsdf, SUBSURFACE), light))
            total = reflected[0] + reflected[1] + reflected[2]
            sums[side, 13] += total * total


@part
def _taken(scene, bsdf, kind, arrived, factor):
    """What Lambertian closures of a kind take of light from two directions, as `arriving` has it."""
    towards, light, direction, met = arrived
    if not bsdf.perturbed:
        return times(mul(total_weight(scene, bsdf, kind), plus(light, met)), factor)
    first = mul(weight_received(scene, bsdf, kind, towards), light)
    second = mul(weight_received(scene, bsdf, kind, direction), met)
    return times(plus(first, second), factor)


@part
def _entering(scene, bsdf, arrived, factor):
    """What of light from two directions, as `arriving` has it, enters a body."""
    towards, light, direction, met = arrived
    first = times(light, received_by_body(scene, bsdf, towards))
    return times(plus(first, times(met, received_by_body(scene, bsdf, direction))), factor)


@part
def _add_columns(sums, side, column, a):
    sums[side, column] += a[0]
    sums[side, column + 1] += a[1]
    sums[side, column + 2] += a[2]


@part
def _is_inside(tracing, room, hidden, origin, normal, key, path):
    """Whether a point is inside of something, by a ray from it."""
    scene = tracing.scene
    if len(hidden) == 0:
        return False
    x, y = two_numbers(key, path, 2)
    direction = to_world(cosine_hemisphere(x, y), normal)
    triangle, _, _, _, _ = closest_hit(tracing, room, origin, direction, _DIFFUSE)
    return triangle >= 0 and is_hidden(scene, hidden, triangle, dot(row(scene.normals, triangle), direction) > ZERO)
