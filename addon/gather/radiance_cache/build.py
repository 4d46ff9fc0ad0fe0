"""How the radiance cache is made: direct light by next-event estimation, and photons for all the rest.

A photon counts for the element it fell on, whose area is known exactly: no search radius, no boundary bias, no leaking.
What remains is noise, and the light's variation within an element, which is why elements are small where many gather
rays end. Where the noise matters, elements gather once themselves, so that receivers see photons two bounces removed.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...core.parallel import Workers, slices
from ...core.sampling.vectors import dot, rows
from ...core.sampling.warps import sample_cosine_hemisphere, to_world
from ...emitters import Sphere
from ...photons import PathKind, Photons
from ...photons.scattering import scatter, shading_ratio
from ...receivers import Receivers
from ...scene import Lobe, Scene
from ...tracing import Hits, TransparencyTracer
from ..direct.direct_light import DirectLight
from ..direct.ray_directions import gather_directions
from ..rays.gather_rays import GatherRays
from .elements import SurfaceCells, SurfaceElements
from .hidden_sides import HiddenSides
from .radiance_cache import RadianceCache

_PILOT, _DIRECT, _REFINE = 11, 12, 13  # streams of random numbers
_MOST_PILOT_RAYS, _PILOT_RAYS_PER_ELEMENT = 1 << 18, 16  # that are sent to see where gather rays end
_N_DIRECT_LOOK, _N_DIRECT_SEEN, _N_DIRECT_UNSEEN, _MAX_DIRECT = 4, 12, 2, 4096
_HOME = 0.8  # of where rays end: what few of them see, out of a window, may be far away
_LEAST_COVERAGE = np.float32(1e-3)  # where samples met nothing but holes
_CHUNK = 1 << 15


@dataclass(frozen=True)
class Survey:
    """Surface elements, and what of them gather rays see.

    Attributes
    ----------
    elements : SurfaceElements
    visits : (2 e,) int64
        Ends of rays from the receivers, and of rays from there on, on each side: front at 2k, back at 2k + 1.
    seen : (2 e,) bool
        Whether light on this side may get to the receivers.
    home : Sphere
        Around the receivers' region, and four fifths of where the rays ended.
    hidden : HiddenSides
        What such rays do not see.
    n_rays : int
        From the receivers.
    """

    elements: SurfaceElements
    visits: np.ndarray
    seen: np.ndarray
    home: Sphere
    hidden: HiddenSides
    n_rays: int

    def worth(self, scene: Scene, photons: Photons) -> np.ndarray:
        """What photons are worth to those who look, (n,): the irradiance, W/m², that they add on the average.

        With ρ what the surface reflects, A the area of its element and v/n the share of the rays that end there, a
        photon of Φ watts adds ρΦ/(πA) · π v/n. Caustics light receivers themselves, whatever ρ is.
        """
        elements = self.elements
        u, v = scene.barycentrics(photons.triangle, photons.position)
        back = dot(rows(scene.normals, photons.triangle), photons.normal) < 0
        looks = self.visits / np.repeat(elements.areas, 2) / self.n_rays
        albedo = scene.albedo(photons.triangle, u, v) + scene.translucence(photons.triangle, u, v)
        power = np.abs(photons.power)
        power = np.where((photons.kind == PathKind.CAUSTIC)[:, None], power, albedo * power)
        return power.mean(axis=1) * looks[2 * elements.find(photons.triangle, u, v) + back]

    @property
    def worth_of_watt(self) -> float:
        """What a watt is worth, at most, if it falls evenly on all that is seen."""
        area = np.repeat(self.elements.areas, 2)[self.visits > 0].sum()
        return float(self.visits.sum() / self.n_rays / max(area, 1e-300))


def survey_surfaces(
    scene: Scene, tracer: TransparencyTracer, receivers: Receivers, region: Sphere, n_elements: int, workers: Workers
) -> Survey:
    """Cut the surfaces into about `n_elements` elements, shared out by where gather rays from `receivers` end.

    Parameters
    ----------
    region : Sphere
        Around most receivers.
    """
    n_rays = min(_PILOT_RAYS_PER_ELEMENT * n_elements, _MOST_PILOT_RAYS)
    met, back = _pilot_hits(scene, tracer, receivers, n_rays, workers)
    hidden = HiddenSides.of(scene, met, back)
    k = np.flatnonzero(scene.materials.spreads_light[scene.material_of_triangle[met.triangle]])
    met, back = met.where(k), back[k]  # a cache has nothing to say of the rest: lamps' bulbs, a sky, mirrors
    cells = SurfaceCells.by_visits(scene, np.bincount(met.triangle, minlength=scene.n_triangles), n_elements)
    cell, _, _ = cells.find(met.triangle, met.u, met.v)
    of_cells = np.bincount(2 * cell + back, minlength=2 * len(cells)).reshape(-1, 2)
    elements = SurfaceElements.by_visits(scene, cells, of_cells.sum(axis=1), n_elements)
    seen = elements.of_cells(of_cells > 0)
    if scene.materials.has(Lobe.TRANSLUCENT).any():
        seen |= seen[:, ::-1]  # either side may shine through to the other
    visits = np.bincount(2 * elements.find(met.triangle, met.u, met.v) + back, minlength=2 * len(elements))
    away = scene.points(met.triangle, met.u, met.v) - region.centre
    reach = float(np.quantile(np.sqrt(dot(away, away)), _HOME)) if len(away) else 0.0
    home = Sphere(region.centre, max(region.radius, reach))
    return Survey(elements, visits, seen.ravel(), home, hidden, n_rays)


def build_radiance_cache(
    scene: Scene,
    tracer: TransparencyTracer,
    photons: Photons,
    direct: DirectLight,
    survey: Survey,
    n_rays: int,
    workers: Workers,
    beyond: GatherRays | None = None,
) -> RadianceCache:
    """A radiance cache of the elements of a survey.

    Parameters
    ----------
    photons : Photons
        With direct photons of those sources only that `direct` does not sample.
    n_rays : int
        Rays that each side seen from the receivers gathers with, from the cache of photons and direct light; 0 leaves
        the photons as they are.
    beyond : GatherRays, optional
        That they gather with instead, where light is cut off after some bounces.
    """
    elements, survey = survey.elements, replace(survey, hidden=survey.hidden.unlit(scene, photons))
    # Light them by the lamps and by photons
    sides = _direct_radiance(scene, tracer, direct, survey, workers)
    focused = photons.kind == PathKind.CAUSTIC
    caustic = photon_radiance(scene, photons.where(focused), elements, sides.coverage)
    others = photon_radiance(scene, photons.where(~focused), elements, sides.coverage)
    cache = RadianceCache.of_sides(elements, sides.radiance + others + caustic, caustic)
    if n_rays == 0:
        return cache

    # Let those that are seen gather once
    k = np.flatnonzero(survey.seen)
    rays = beyond or GatherRays(scene, tracer, direct, cache)
    gathered = np.zeros_like(sides.radiance)
    gathered[k] = _gather_at_sides(scene, rays, survey, k, n_rays, workers)
    refined = cache.radiance[:-2].copy()
    refined[k] = (sides.radiance + caustic + sides.albedo * gathered + sides.translucence * _swapped(gathered))[k]
    return RadianceCache.of_sides(elements, refined, caustic)


def _swapped(of_sides: np.ndarray) -> np.ndarray:
    """Values (2 e, …) of each side's other side."""
    return of_sides.reshape(-1, 2, *of_sides.shape[1:])[:, ::-1].reshape(of_sides.shape)


def _pilot_hits(
    scene: Scene, tracer: TransparencyTracer, receivers: Receivers, n_rays: int, workers: Workers
) -> tuple[Hits, np.ndarray]:
    """Where gather rays from the receivers end, and rays from there on; whether on a triangle's back, (n,) bool."""
    start = np.linspace(0, len(receivers), n_rays, endpoint=False).astype(np.int64)  # every receiver alike

    def fly(chunk: slice, random: np.random.Generator) -> list[tuple[Hits, np.ndarray]]:
        normals, origins = rows(receivers.normal, start[chunk]), rows(receivers.position, start[chunk])
        directions = to_world(sample_cosine_hemisphere(random.random((len(normals), 2), dtype=np.float32)), normals)
        met = []
        for step in range(2):
            hits = tracer.closest_hit(origins, directions)
            hit = np.flatnonzero(hits.hit)
            hits, directions = hits.where(hit), rows(directions, hit)
            met.append((hits, hits.back(directions)))
            if step == 0:
                positions, normals = hits.points(scene, directions)
                on = scatter(scene, hits, positions, directions, normals, random)
                origins, directions = on.origins, on.directions
        return met

    chunks = workers.chunks("Refining surfaces", n_rays, _CHUNK, fly, (_PILOT,))
    parts = [part for _, met in chunks for part in met]
    return Hits.join([hits for hits, _ in parts]), np.concatenate([back for _, back in parts])


def photon_radiance(
    scene: Scene, photons: Photons, elements: SurfaceElements, coverage: np.ndarray | None = None
) -> np.ndarray:
    """Diffuse radiance that photons make of the sides they fell on and of those behind, Σ ρΦ/(πAc), (2 e, 3) float32.

    Parameters
    ----------
    coverage : (2 e,) float32, optional
        c, the share of each element that stops light; 1 without it.
    """
    radiance = np.zeros((2 * len(elements), 3), np.float64)
    for chunk in slices(len(photons), 1 << 20):
        part = photons.where(chunk)
        u, v = scene.barycentrics(part.triangle, part.position)
        normals = rows(scene.normals, part.triangle)
        back = dot(normals, part.normal) < 0
        side = 2 * elements.find(part.triangle, u, v) + back
        normals = np.where(back[:, None], -normals, normals)
        shading = scene.shading_normals(part.triangle, u, v, normals)
        power = part.power * shading_ratio(shading, normals, part.direction)[:, None]
        _add(radiance, side, scene.albedo(part.triangle, u, v) * power)
        if scene.materials.has(Lobe.TRANSLUCENT).any():
            through = scene.translucence(part.triangle, u, v)
            _add(radiance, side ^ 1, through * power)
    area = np.repeat(elements.areas, 2) * (1 if coverage is None else coverage)
    return (radiance / (np.pi * area)[:, None]).astype(np.float32)


def _add(sums: np.ndarray, index: np.ndarray, values: np.ndarray) -> None:
    """Add values (n, 3) to the rows `index` of sums (m, 3)."""
    for channel in range(3):
        sums[:, channel] += np.bincount(index, values[:, channel], minlength=len(sums))


@dataclass(frozen=True)
class _Sides:
    """What direct light makes of the sides of elements, and means over their surface, rows 2 e.

    Attributes
    ----------
    radiance : (2 e, 3) float32, W/(m² sr)
        That direct light on this side and on the other makes.
    albedo, translucence : (2 e, 3) float32
        Of what is stopped.
    coverage : (2 e,) float32
        Share of the light that is stopped.
    """

    radiance: np.ndarray
    albedo: np.ndarray
    translucence: np.ndarray
    coverage: np.ndarray


def _direct_radiance(
    scene: Scene,
    tracer: TransparencyTracer,
    direct: DirectLight,
    survey: Survey,
    workers: Workers,
) -> _Sides:
    """Mean of ρE/π of direct light over points of each side, and what is to be known of the sides besides.

    Half of the points go to all sides evenly, half by the spread that a first look finds (Neyman's allocation): beside
    a lamp the light of an element is that of a small spot on it. What the first look found is not used again, since
    elements in which it missed the light get fewer points than others.
    """
    seen = survey.seen
    n_look = np.where(seen, _N_DIRECT_LOOK, 1)
    look = _lit_points(scene, tracer, direct, survey, n_look, workers, (_DIRECT, 0))
    spread = np.sqrt(np.maximum(look[:, 13] / n_look - (look[:, :3].sum(axis=1) / n_look) ** 2, 0)) * seen
    even = np.where(seen, _N_DIRECT_SEEN, _N_DIRECT_UNSEEN) // 2
    counts = even + np.minimum(even.sum() * spread / max(float(spread.sum()), 1e-30), _MAX_DIRECT).astype(np.int64)
    sums = _lit_points(scene, tracer, direct, survey, counts, workers, (_DIRECT, 1))
    weight = sums[:, 12:13]
    reflected, transmitted, albedo, through = (sums[:, i : i + 3] / weight for i in range(0, 12, 3))
    # Of an element that is nearly all hole the share is not known well: photons on the rest must not count for too much
    coverage = np.maximum(weight[:, 0] / counts, 1 / counts)
    columns = (reflected + _swapped(transmitted), albedo, through, coverage)
    return _Sides(*(column.astype(np.float32) for column in columns))


def _lit_points(
    scene: Scene,
    tracer: TransparencyTracer,
    direct: DirectLight,
    survey: Survey,
    counts: np.ndarray,
    workers: Workers,
    key: tuple[int, ...],
) -> np.ndarray:
    """Sums over `counts` (2 e,) random points of each side, (2 e, 14) float64.

    Columns: ρE/π, τE/π, ρ and τ in colours, each times the coverage, the coverage, and the square of the sum of the
    first three.
    """
    ends = np.concatenate([[0], np.cumsum(counts)])

    def estimate(chunk: slice, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        side = np.searchsorted(ends, np.arange(chunk.start, chunk.stop), side="right") - 1
        at = _points_on(scene, survey.elements, side, random)
        light = direct.irradiance(at.positions, at.shading_normals, at.objects, random) / np.float32(np.pi)
        albedo, through = scene.albedo(at.triangle, at.u, at.v), scene.translucence(at.triangle, at.u, at.v)
        coverage = scene.look_up(scene.materials.coverage, at.triangle, at.u, at.v)
        buried = tracer.coplanar_occluded(at.triangle, at.u, at.v) | _inside(scene, tracer, survey, at, random)
        coverage = coverage[:, :1] * ~buried[:, None]
        coverage = np.maximum(coverage, _LEAST_COVERAGE)
        columns = np.concatenate([albedo * light, through * light, albedo, through, np.ones_like(coverage)], axis=1)
        columns *= coverage
        square = columns[:, :3].sum(axis=1, keepdims=True) ** 2
        first = np.flatnonzero(np.append(True, side[1:] != side[:-1]))
        return side[first], np.add.reduceat(np.concatenate([columns, square], axis=1), first, dtype=np.float64)

    sums = np.zeros((len(counts), 14))
    part = (0.5 * key[1], 0.5 * (key[1] + 1))
    for _, (side, added) in workers.chunks("Lighting surfaces", int(ends[-1]), _CHUNK, estimate, key, part):
        sums[side] += added
    return sums


@dataclass(frozen=True)
class _Points:
    """n points of surface elements: where, on which side, of what."""

    positions: np.ndarray
    normals: np.ndarray
    shading_normals: np.ndarray
    triangle: np.ndarray
    u: np.ndarray
    v: np.ndarray
    objects: np.ndarray


def _points_on(scene: Scene, elements: SurfaceElements, side: np.ndarray, random: np.random.Generator) -> _Points:
    """A random point on each of `side`, off the surface."""
    triangle, u, v = elements.sample(side // 2, random.random((len(side), 3), dtype=np.float32))
    normals = np.where(side % 2 == 0, np.float32(1), np.float32(-1))[:, None] * rows(scene.normals, triangle)
    positions = scene.points(triangle, u, v)
    positions += scene.ray_offset(triangle, positions) * normals
    shading = scene.shading_normals(triangle, u, v, normals)
    return _Points(positions, normals, shading, triangle, u, v, scene.object_of_triangle[triangle])


def _inside(
    scene: Scene, tracer: TransparencyTracer, survey: Survey, at: _Points, random: np.random.Generator
) -> np.ndarray:
    """Whether points are inside of something, (n,) bool, by a ray from each."""
    if not survey.hidden.any:
        return np.zeros(len(at.normals), bool)
    u = random.random((len(at.normals), 2), dtype=np.float32)
    directions = to_world(sample_cosine_hemisphere(u), at.normals)
    return survey.hidden.met(scene, tracer.closest_hit(at.positions, directions), directions)


def _gather_at_sides(
    scene: Scene, rays: GatherRays, survey: Survey, sides: np.ndarray, n_rays: int, workers: Workers
) -> np.ndarray:
    """Mean radiance (E/π) from the cache and the world at each of `sides`, (n, 3): a ray from a new point each time.

    Points inside of something do not count.
    """

    def gather(chunk: slice, random: np.random.Generator) -> np.ndarray:
        at = _points_on(scene, survey.elements, np.repeat(sides[chunk], n_rays), random)
        directions = gather_directions(at.shading_normals, n_rays, random)
        met = rays.radiance_along(at.positions, directions, random, facets=at.normals)
        outside = ~survey.hidden.met(scene, met.hits, directions).reshape(-1, n_rays, 1)
        light = (met.reflected + met.sky).reshape(-1, n_rays, 3) * outside
        return light.sum(axis=1) / np.maximum(outside.sum(axis=1), 1)

    gathered = np.zeros((len(sides), 3), np.float32)
    for chunk, mean in workers.chunks("Refining light", len(sides), max(1, _CHUNK // n_rays), gather, (_REFINE,)):
        gathered[chunk] = mean
    return gathered
