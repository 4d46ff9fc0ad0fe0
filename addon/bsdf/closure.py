"""The closures of a point on a surface, as the scattering sees them, inside kernels.

The local frame has as +z the normal of the side that the light came to; wo is where it came from, so wo.z > 0.
Transmitted directions have wi.z < 0. Closures with normals of their own have frames within it, see `frames`.

Paths and photons follow the same f(view, light), the one from the view, the other from the light. All of f is
reciprocal but for the factors that belong to the viewing side: what layers leave to what they cover, the scale of
multiple scattering, and how refraction changes radiance. A photon views from where it goes, so they are taken there.
"""

from typing import NamedTuple

import numpy as np

from ..core.compiling import part
from ..core.vec3 import BLACK, ONE, ZERO, negative, row
from ..scene.closures import Lobe
from ..scene.hit import channel_at

GLOSSY, GLASS = int(Lobe.GLOSSY), int(Lobe.GLASS)


class Bsdf(NamedTuple):
    """What a point does to light that comes to one side of it: closures `first` to `last` of the scene's.

    normal : the geometric one of that side.
    perturbed : whether a closure has a normal of its own; then +z of the local frame is `normal`, see `frames`.
    """

    first: np.int32
    last: np.int32
    triangle: np.int32
    u: np.float32
    v: np.float32
    back: bool
    normal: tuple
    perturbed: bool


class Closure(NamedTuple):
    """One of them with its values there; `ior` of glass is that beyond the surface over that of the side met."""

    kind: np.int32
    weight: tuple
    roughness: np.float32
    f0: tuple
    f90: tuple
    ior: np.float32
    fresnel: bool
    preserves_energy: bool
    layer: np.int32


@part
def bsdf_at(scene, hit):
    """The scattering where a ray met a surface."""
    return bsdf_of(scene, hit.triangle, hit.u, hit.v, hit.back)


@part
def bsdf_of(scene, triangle, u, v, back):
    """The scattering at a point of a triangle, of light that comes to its back or else its front."""
    material, start = scene.material[triangle], scene.materials.closures.start
    normal = row(scene.normals, triangle)
    if back:
        normal = negative(normal)
    perturbed = scene.materials.perturbed[material]
    return Bsdf(start[material], start[material + 1], triangle, u, v, back, normal, perturbed)


@part
def closure_at(scene, bsdf, k):
    """The k-th closure of the scene at a point that has it."""
    closures, at = scene.materials.closures, (bsdf.triangle, bsdf.u, bsdf.v)
    kind, ior = closures.kind[k], closures.ior[k]
    weight, roughness, f0, f90 = channel_at(scene, closures.weight, k, *at), ONE, BLACK, BLACK
    if kind >= GLOSSY:
        roughness = channel_at(scene, closures.roughness, k, *at)[0]
        f0, f90 = channel_at(scene, closures.f0, k, *at), channel_at(scene, closures.f90, k, *at)
    if kind == GLASS and bsdf.back:
        ior = ONE / ior
    fresnel, preserves_energy = closures.fresnel[k], closures.preserves_energy[k]
    return Closure(kind, weight, roughness, f0, f90, ior, fresnel, preserves_energy, closures.layer[k])


@part
def alpha_of(closure):
    """GGX's α."""
    return closure.roughness * closure.roughness


@part
def radiance_scale(ior, from_light):
    """(η_light/η_view)² of refraction away from the side that `ior` is seen from; 1 for a path."""
    return ONE / (ior * ior) if from_light else ONE


@part
def is_nothing(color):
    """Whether a colour is black."""
    return color[0] == ZERO and color[1] == ZERO and color[2] == ZERO
