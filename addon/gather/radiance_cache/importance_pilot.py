"""The importance pilot: which surfaces gather rays end on, found by a few of them before photons are traced."""

from dataclasses import dataclass

import numpy as np

from ...bsdf.mixture import ALL_LOBES, SUBSURFACE
from ...bsdf.scatter import scatter
from ...core.compiling import kernel
from ...core.parallel import Workers
from ...core.sampling.path_numbers import path_key, two_numbers
from ...core.sampling.vectors import dot
from ...core.sampling.warps import cosine_hemisphere
from ...core.vec3 import row, to_world
from ...emitters import Sphere
from ...photons import Photons
from ...receivers import Receivers
from ...scene import Lobe, RayKind, Scene
from ...scene.hit import hit_at
from ...tracing import TransparencyTracer
from ...tracing.bodies.through import entered, outside_of, walk_key
from ...tracing.embree import new_ray
from ...tracing.transparency import closest_hit
from ..on_bodies import OnBodies, arrivals
from .elements import SurfaceCells, SurfaceElements
from .hidden_sides import HiddenSides
from .photon_radiance import photon_importance

_PILOT = 11  # stream of random numbers
_MOST_RAYS, _RAYS_PER_ELEMENT = 1 << 18, 16
_TARGET = 0.8  # of where rays end: what few of them see, out of a window, may be far away
_CHUNK = 1 << 14
_DIFFUSE = int(RayKind.DIFFUSE)


@dataclass(frozen=True)
class ImportancePilot:
    """Surface elements, and what of them gather rays see.

    Attributes
    ----------
    elements : SurfaceElements
    visits : (2 e,) int64
        Ends of rays from the receivers, and of rays from there on, on each side: front at 2k, back at 2k + 1.
    seen : (2 e,) bool
        Whether light on this side may get to the receivers.
    target_region : Sphere
        Around the receivers' region, and four fifths of where the rays ended.
    hidden : HiddenSides
        What such rays do not see.
    n_rays : int
        From the receivers.
    """

    elements: SurfaceElements
    visits: np.ndarray
    seen: np.ndarray
    target_region: Sphere
    hidden: HiddenSides
    n_rays: int

    def importance(self, scene: Scene, photons: Photons) -> np.ndarray:
        """Importance of photons, (n,) float64: the irradiance, W/m², that each adds at receivers on the average.

        With ρ what the surface reflects, A the area of its element and v/n the share of the rays that end there, a
        photon of Φ watts adds ρΦ/(πA) · π v/n. Caustics light receivers themselves, whatever ρ is.
        """
        hits_per_area = self.visits / np.repeat(self.elements.areas, 2) / self.n_rays
        return photon_importance(scene, photons, self.elements, hits_per_area)

    @property
    def importance_of_watt(self) -> float:
        """Importance of a watt, at most, that falls evenly on all that is seen."""
        area = np.repeat(self.elements.areas, 2)[self.visits > 0].sum()
        return float(self.visits.sum() / self.n_rays / max(area, 1e-300))


def importance_pilot(
    scene: Scene, tracer: TransparencyTracer, receivers: Receivers, region: Sphere, n_elements: int, workers: Workers
) -> ImportancePilot:
    """Cut the surfaces into about `n_elements` elements, shared out by where gather rays from `receivers` end.

    Parameters
    ----------
    region : Sphere
        Around most receivers.
    """
    n_rays = min(_RAYS_PER_ELEMENT * n_elements, _MOST_RAYS)
    triangle, u, v, back = _pilot_hits(scene, tracer, receivers, n_rays, workers)
    hidden = HiddenSides.of(scene, triangle, back)
    k = np.flatnonzero(scene.materials.spreads_light[scene.material_of_triangle[triangle]])
    # A cache has nothing to say of the rest: lamps' bulbs, a sky, mirrors
    triangle, u, v, back = triangle[k], u[k], v[k], back[k]
    cells = SurfaceCells.by_visits(scene, np.bincount(triangle, minlength=scene.n_triangles), n_elements)
    cell, _, _ = cells.find(triangle, u, v)
    of_cells = np.bincount(2 * cell + back, minlength=2 * len(cells)).reshape(-1, 2)
    elements = SurfaceElements.by_visits(scene, cells, of_cells.sum(axis=1), n_elements)
    seen = elements.of_cells(of_cells > 0)
    if scene.materials.has(Lobe.TRANSLUCENT).any():
        seen |= seen[:, ::-1]  # either side may shine through to the other
    if scene.materials.subsurface.any():
        seen |= elements.of_cells(_behind_bodies(scene, triangle, back)[cells.triangle])
    visits = np.bincount(2 * elements.find(triangle, u, v) + back, minlength=2 * len(elements))
    away = scene.points(triangle, u, v) - region.centre
    reach = float(np.quantile(np.sqrt(dot(away, away)), _TARGET)) if len(away) else 0.0
    target = Sphere(region.centre, max(region.radius, reach))
    return ImportancePilot(elements, visits, seen.ravel(), target, hidden, n_rays)


def _behind_bodies(scene: Scene, triangle: np.ndarray, back: np.ndarray) -> np.ndarray:
    """Sides that light may come from through a body, (t, 2) bool: those of which some were seen, of the same object."""
    of = scene.object_of_triangle
    seen = np.zeros((len(scene.objects.names), 2), bool)
    walks = scene.materials.subsurface[scene.material_of_triangle[triangle]]
    seen[of[triangle[walks]], back[walks].astype(np.int64)] = True
    return seen[of]


def _pilot_hits(
    scene: Scene, tracer: TransparencyTracer, receivers: Receivers, n_rays: int, workers: Workers
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Where gather rays from the receivers end, and rays from there on: triangle, u, v, and whether on its back."""
    start = np.linspace(0, len(receivers), n_rays, endpoint=False).astype(np.int64)  # every receiver alike
    key = path_key(workers.seed, _PILOT)
    triangle, back = np.full((n_rays, 2), -1, np.int32), np.zeros((n_rays, 2), bool)
    u, v = np.zeros((2, n_rays, 2), np.float32)

    on = OnBodies.of(scene, tracer.surfaces, receivers)

    def fly(chunk: slice, _: np.random.Generator) -> None:
        at = receivers.position, receivers.normal, start[chunk]
        if on is not None:
            k = start[chunk]
            normals = receivers.normal[k]
            came = arrivals(tracer, on.where(k), receivers.position[k], normals, normals, 1, key, chunk.start)
            at = came.position, came.normal, np.arange(len(k))
        met = triangle[chunk], u[chunk], v[chunk], back[chunk]
        _fly(tracer.arrays, new_ray(), *at, key, chunk.start, *met)

    for _ in workers.chunks("Refining surfaces", n_rays, _CHUNK, fly, (_PILOT,)):
        pass
    hit = triangle >= 0
    return triangle[hit], u[hit], v[hit], back[hit]


@kernel
def _fly(tracing, room, positions, normals, start, key, first, triangle, u, v, back):
    """Send a ray from each receiver of `start` (n,), and one on from where it ends, or a walk through the body there;
    write both ends, (n, 2).
    """
    scene = tracing.scene
    for k in range(len(start)):
        path, origin = first + k, row(positions, start[k])
        x, y = two_numbers(key, path, 0)
        direction, kind = to_world(cosine_hemisphere(x, y), row(normals, start[k])), _DIFFUSE
        for step in range(2):
            met, distance, a, b, _ = closest_hit(tracing, room, origin, direction, kind)
            if met < 0:
                break
            hit = hit_at(scene, direction, met, distance, a, b)
            triangle[k, step], u[k, step], v[k, step], back[k, step] = met, a, b, hit.back
            x, y = two_numbers(key, path, 1)
            choice, _ = two_numbers(key, path, 2)
            on = scatter(scene, hit, direction, choice, x, y, ALL_LOBES, False, np.int64(kind))
            if not on.alive:
                break
            if on.lobe == SUBSURFACE and step == 0:
                exit_ = entered(tracing, room, hit, on.direction, kind, walk_key(key, 0), path)
                if exit_.found:
                    triangle[k, 1], u[k, 1], v[k, 1] = exit_.triangle, exit_.u, exit_.v
                    back[k, 1] = outside_of(scene, exit_).back
                break
            origin, direction, kind = on.origin, on.direction, on.kind
