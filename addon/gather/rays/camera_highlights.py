"""Direct light that gloss and rough glass reflect where a camera sees them in mirrors or through glass: highlights.

Points of lamps find small lights well, rays by the lobe large ones. Each light in each direction is left to the way
that finds it more often (the maximum heuristic: Veach 1997, 9.2.4): lamps by their densities, emissive meshes and
worlds, whose points `DirectLight` draws together, by whether the lobe is a peak there.
"""

from dataclasses import dataclass

import numpy as np

from ...bsdf import Surface, evaluate_broad, evaluate_glossy, pdf_glossy, surface_at
from ...core.parallel import Workers
from ...emitters.lamp_hits import lamp_hits, lamps_along
from ...photons.scattering import NARROW_LOBES, facing, local_axes, scatter
from ...receivers import CameraPoints, SeenSurface
from ...scene import Scene
from ...tracing import TransparencyTracer
from ...tracing.emission import emission_met
from ..direct.direct_light import DirectLight
from .lobe_rays import mean_over_rays, ray_counts

_LEAST_RAYS = 8  # of a point: highlights are bright however little gloss there is
_HIGHLIGHTS = 76  # stream of random numbers


def reflected_highlights(
    scene: Scene, points: CameraPoints, direct: DirectLight, tracer: TransparencyTracer, n_rays: int, workers: Workers
) -> tuple[np.ndarray, np.ndarray]:
    """Radiance by direct light on glossy and glass lobes that are seen in mirrors or through glass, as pixels get it.

    Parameters
    ----------
    n_rays : int
        And as many points of lights, of a point that reflects everything; others have fewer in proportion.

    Returns
    -------
    radiance : (n, 3) float32, W/(m² sr)
        0 for what the camera itself sees.
    stderr : (n,) float32, W/(m² sr)
        Of its mean over colours.
    """
    radiance, stderr = np.zeros((len(points), 3), np.float32), np.zeros(len(points), np.float32)
    narrow = scene.materials.glossy_or_glass[scene.material_of_triangle[points.seen.hits.triangle]]
    point = np.flatnonzero(narrow & (points.n_followed > 0))
    if len(point) == 0:
        return radiance, stderr
    counts = ray_counts(scene, points, point, n_rays, _LEAST_RAYS)

    def light(of_ray: np.ndarray, random: np.random.Generator) -> np.ndarray:
        k = point[of_ray]
        at = _Glossy.of(scene, points.seen.where(k))
        return points.tint[k] * (_by_points_of_lights(scene, at, direct, random) + _by_rays(scene, at, tracer, random))

    radiance[point], stderr[point] = mean_over_rays(counts, light, "Highlights in mirrors", _HIGHLIGHTS, workers)
    return radiance, stderr


@dataclass(frozen=True)
class _Glossy:
    """n points: where they are seen, what they do to light, their normals and axes (n, 3, 3), and their objects."""

    seen: SeenSurface
    surface: Surface
    normals: np.ndarray
    axes: np.ndarray
    objects: np.ndarray

    @staticmethod
    def of(scene: Scene, seen: SeenSurface) -> "_Glossy":
        hits = seen.hits
        surface = surface_at(scene, hits.triangle, hits.u, hits.v, hits.back(seen.direction))
        normals = facing(seen.shading_normal, seen.normal, seen.direction)
        return _Glossy(seen, surface, normals, local_axes(normals), scene.object_of_triangle[hits.triangle])

    def local(self, directions: np.ndarray) -> np.ndarray:
        """Directions (n, 3) in the points' frames."""
        return np.einsum("nij,nj->ni", self.axes, directions)


def _by_points_of_lights(scene: Scene, at: _Glossy, direct: DirectLight, random: np.random.Generator) -> np.ndarray:
    """What points of lights give that rays by the rough glossy lobe find less often, (n, 3) float32, W/(m² sr)."""
    seen = at.seen
    origins = seen.position + scene.ray_offset(seen.hits.triangle, seen.position) * seen.normal
    light = direct.sample(origins, at.normals, at.objects, random, rays_own=False)
    wo, wi = at.local(-seen.direction), at.local(light.direction)
    f = evaluate_broad(at.surface, wo, wi)
    k = np.flatnonzero(light.source < len(scene.lights))
    pdf = pdf_glossy(at.surface.where(k), wo[k], wi[k])
    found = pdf <= lamp_hits(scene.lights, light.source[k], origins[k], light.direction[k]).density
    f[k] = evaluate_glossy(at.surface.where(k), wo[k], wi[k]) * found[:, None]
    return f * light.irradiance


def _by_rays(scene: Scene, at: _Glossy, tracer: TransparencyTracer, random: np.random.Generator) -> np.ndarray:
    """What rays by the lobes meet that is left to them, (n, 3) float32, W/(m² sr)."""
    seen = at.seen
    on = scatter(scene, seen.hits, seen.position, seen.direction, seen.normal, random, NARROW_LOBES)
    hits = tracer.closest_hit(on.origins, on.directions, on.kind)
    assert on.rough is not None
    pdf = pdf_glossy(at.surface, at.local(-seen.direction), at.local(on.directions))

    met = lamps_along(
        scene.lights,
        on.origins,
        on.directions,
        hits.distance,
        on.kind,
        at.objects,
        least_density=np.where(on.rough, pdf, np.float32(np.inf)),
    )
    k = np.flatnonzero(on.focused | (~hits.hit & (scene.world.image is None)))
    met[k] += emission_met(scene, hits.where(k), on.directions[k])
    return on.weight * hits.tinted(met)
