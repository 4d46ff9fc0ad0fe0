"""What glossy surfaces reflect of the light in a volume, towards who looks at them."""

import numpy as np

from ...bsdf import Lobe
from ...core.parallel import Workers
from ...core.sampling.spherical_harmonics import Y0, Y1, sh_basis
from ...photons.scattering import scatter
from ...receivers import SeenSurface
from ...scene import Scene
from . import Cascade

_N_SAMPLES = 8  # directions a pixel: light of two bands is smooth
_CHUNK = 1 << 14  # pixels

_SCATTERING = 72  # stream of random numbers


def glossy_radiance(scene: Scene, seen: SeenSurface, volumes: Cascade, workers: Workers) -> np.ndarray:
    """Radiance ∫ f(ω, ω_o) L(ω) |cos| dω that the glossy lobe sends to the camera: (p, 3) float32, W/(m² sr).

    L is read once in front of the surface; directions ω are sampled by the lobe.
    """
    shiny = scene.materials.has(Lobe.GLOSSY)[scene.material_of_triangle[seen.hits.triangle]]
    glossy, radiance = np.flatnonzero(shiny), np.zeros((len(seen), 3), np.float32)

    def reflect(chunk: slice, random: np.random.Generator) -> np.ndarray:
        k = glossy[chunk]
        hits, position, normal = seen.hits.where(k), seen.position[k], seen.normal[k]
        lifted = position + scene.ray_offset(hits.triangle, position) * normal
        light = nowhere_negative(volumes.radiance(lifted, normal)[:, :3])
        total = np.zeros((len(k), 3), np.float32)
        for _ in range(_N_SAMPLES):
            on = scatter(scene, hits, position, seen.direction[k], normal, random, 1 << Lobe.GLOSSY)
            total += on.weight * np.einsum("nca,na->nc", light, sh_basis(on.directions))
        return total / _N_SAMPLES

    for chunk, value in workers.chunks("Reflecting the volume", len(glossy), _CHUNK, reflect, (_SCATTERING,)):
        radiance[glossy[chunk]] = value
    return radiance


def nowhere_negative(radiance: np.ndarray) -> np.ndarray:
    """Coefficients (n, c, 4) with as much of their linear bands as leaves Y₀ L₀ − Y₁ |L₁| ≥ 0 in every direction.

    What two bands make of light from one side is negative on the other, where colours would come out wrong.
    """
    constant, linear = np.maximum(radiance[..., :1], 0), radiance[..., 1:]
    length = np.linalg.norm(linear, axis=-1, keepdims=True)
    share = np.minimum(Y0 * constant / np.maximum(Y1 * length, np.float32(1e-30)), 1)
    return np.concatenate([constant, share * linear], axis=-1)
