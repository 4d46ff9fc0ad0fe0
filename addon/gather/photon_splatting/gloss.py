"""The light of photons that rough glossy surfaces reflect to a camera: Eq. 1 with the surface's own lobe."""

import numpy as np

from ...bsdf import glossy_albedo, reflects_highlights, surface_at
from ...bsdf.closure import bsdf_at
from ...bsdf.mixture import evaluate_glossy
from ...bsdf.scatter import axis_at
from ...core.compiling import kernel
from ...core.parallel import Workers, slices
from ...core.sampling.vectors import dot
from ...core.vec3 import negative, put, row, to_local
from ...photons import Photons
from ...receivers import Camera, SeenSurface
from ...receivers.camera.camera import LEAST_COSINE
from ...scene import RayKind, Scene
from ...scene.hit import hit_at
from ...tracing import Tracer
from .photon_splatting import splat_light
from .radius import OF_SCATTERED
from .splat import Response

_LEAST_ALBEDO = np.float32(1e-6)  # to divide by
_CAMERA = int(RayKind.CAMERA)
_CHUNK = 1 << 16  # points


def splat_gloss(
    scene: Scene,
    camera: Camera,
    seen: SeenSurface,
    photons: Photons,
    workers: Workers,
    step: int = 1,
    tracer: Tracer | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Radiance Σ f(ω, ω_o) Φ κ that glossy lobes send to where they are seen from, of photons that fly along −ω.

    Eq. 1 has a cosine more. The photons' density in space has it already: Φ κ is irradiance. Mirrors, whose f is 0
    wherever it can be evaluated, reflect nothing of this.

    Parameters
    ----------
    step, tracer
        As for `splat_irradiance`. What is interpolated is the radiance over the lobe's albedo, so that
        textures of gloss are as sharp as without.

    Returns
    -------
    radiance : (p, 3) float32, W/(m² sr)
    stderr : (p,) float32
        Of its mean over colours.
    """
    rough, albedo = _rough(scene, seen)
    at, flown = seen.where(rough), photons.direction

    def response(k: np.ndarray) -> Response:
        part, of_lobe = at.where(k), np.maximum(albedo[k], _LEAST_ALBEDO)
        hits, arguments = part.hits, (part.direction, flown, of_lobe)

        def reflect(point: np.ndarray, photon: np.ndarray) -> np.ndarray:
            factor = np.empty((len(point), 3), np.float32)
            _reflect(scene.arrays, hits.triangle, hits.distance, hits.u, hits.v, *arguments, point, photon, factor)
            return factor

        return reflect

    radiance, stderr = np.zeros((len(seen), 3), np.float32), np.zeros(len(seen), np.float32)
    found = splat_light(camera, at, photons, response, workers, step, tracer, OF_SCATTERED)
    radiance[rough], stderr[rough] = found[:, :3] * albedo, found[:, 3] * albedo.mean(axis=1)
    return radiance, stderr


@kernel
def _reflect(scene, triangle, distance, u, v, directions, flown, of_lobe, point, photon, out):
    """The lobe's f of pairs of a point and a photon, over the lobe's albedo."""
    for i in range(len(point)):
        k = point[i]
        direction = row(directions, k)
        hit = hit_at(scene, direction, triangle[k], distance[k], u[k], v[k])
        axis = axis_at(scene, hit, direction)
        wo, wi = to_local(negative(direction), axis), to_local(negative(row(flown, photon[i])), axis)
        f, albedo = evaluate_glossy(scene, bsdf_at(scene, hit, _CAMERA), wo, wi), row(of_lobe, k)
        put(out, i, (f[0] / albedo[0], f[1] / albedo[1], f[2] / albedo[2]))


def _rough(scene: Scene, seen: SeenSurface) -> tuple[np.ndarray, np.ndarray]:
    """Indices (r,) of points that have a rough glossy lobe, and this lobe's albedo as it is seen, (r, 3) float32."""
    glossy = np.flatnonzero(scene.materials.narrow[scene.material_of_triangle[seen.hits.triangle]])
    rough, albedo = [np.zeros(0, np.int64)], [np.zeros((0, 3), np.float32)]
    for chunk in slices(len(glossy), _CHUNK):
        k = glossy[chunk]
        part = seen.where(k)
        surface = surface_at(scene, part.hits.triangle, part.hits.u, part.hits.v, part.hits.back(part.direction))
        some = np.flatnonzero(reflects_highlights(surface))
        cosine = np.maximum(np.abs(dot(part.shading_normal, part.direction)), LEAST_COSINE)
        rough.append(k[some])
        albedo.append(glossy_albedo(surface.where(some), cosine[some]))
    return np.concatenate(rough), np.concatenate(albedo)
