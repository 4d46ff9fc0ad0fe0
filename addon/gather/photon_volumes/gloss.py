"""The light of photons that rough glossy surfaces reflect to a camera: Eq. 1 with the surface's own lobe."""

import numpy as np

from ...bsdf import SMOOTH, evaluate_glossy, surface_at
from ...parallel import Workers
from ...photons import Photons
from ...photons.scattering import facing, local_axes
from ...receivers import Camera, SeenSurface
from ...scene import Scene
from .scatter import Points, scatter_light
from .volumes import volume_radius


def photon_volume_gloss(
    scene: Scene, camera: Camera, seen: SeenSurface, photons: Photons, workers: Workers
) -> tuple[np.ndarray, np.ndarray]:
    """Radiance Σ f(ω, ω_o) Φ κ that glossy lobes send to where they are seen from, of photons that fly along −ω.

    Eq. 1 has a cosine more. The photons' density in space has it already: Φ κ is irradiance. Mirrors, whose f is 0
    wherever it can be evaluated, reflect nothing of this.

    Returns
    -------
    radiance : (p, 3) float32, W/(m² sr)
    stderr : (p,) float32
        Of its mean over colours.
    """
    hits = seen.hits
    surface = surface_at(scene, hits.triangle, hits.u, hits.v, hits.back(seen.direction))
    rough = np.flatnonzero((surface.roughness >= SMOOTH) & ((surface.f0 > 0) | (surface.f90 > 0)).any(axis=1))
    at, surface = seen.where(rough), surface.where(rough)
    axes = local_axes(facing(at.shading_normal, at.normal, at.direction))
    to_camera, from_light = np.einsum("nij,nj->ni", axes, -at.direction), -photons.direction

    def reflect(point: np.ndarray, photon: np.ndarray) -> np.ndarray:
        to_light = np.einsum("nij,nj->ni", axes[point], from_light[photon])
        return evaluate_glossy(surface.where(point), to_camera[point], to_light)

    radiance, stderr = np.zeros((len(seen), 3), np.float32), np.zeros(len(seen), np.float32)
    radius = volume_radius(camera, seen, photons, workers)
    found = scatter_light(Points(at.position, at.normal), photons, radius, workers, reflect)
    radiance[rough], stderr[rough] = found.light, found.stderr
    return radiance, stderr
