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
from ..core.vec3 import BLACK, ONE, WHITE, ZERO, negative, row
from ..scene.closures import Lobe
from ..scene.hit import channel_at
from .microfacets import Facets

GLOSSY, GLASS = int(Lobe.GLOSSY), int(Lobe.GLASS)

_TINY = np.float32(1e-20)


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
    """One of them with its values there.

    Of glass, `ior` and that of its film are over that of the side met.
    """

    kind: np.int32
    weight: tuple
    roughness: np.float32
    f0: tuple
    f90: tuple
    ior: np.float32
    fresnel: bool
    preserves_energy: bool
    layer: np.int32
    distribution: np.int32
    curve: np.int32
    edge: tuple
    film: tuple
    stretch: np.float32


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
    kind, ior, curve = closures.kind[k], closures.ior[k], closures.curve[k]
    weight, roughness = channel_at(scene, closures.weight, k, *at), ONE
    f0, f90, edge, film = BLACK, BLACK, WHITE, BLACK
    if kind >= GLOSSY:
        roughness = channel_at(scene, closures.roughness, k, *at)[0]
        f0, f90 = channel_at(scene, closures.f0, k, *at), channel_at(scene, closures.f90, k, *at)
    if curve > 0:
        edge = channel_at(scene, closures.edge, k, *at)
    if closures.film.value[k, 0] > ZERO:
        film = channel_at(scene, closures.film, k, *at)
    if kind == GLASS and bsdf.back:
        ior = ONE / ior
        film = film[0], film[1] * ior, film[2]
    stretch = ONE
    if closures.stretched[k]:
        roughness, stretch = _stretched(roughness, channel_at(scene, closures.stretch, k, *at)[0])
    look = closures.fresnel[k], closures.preserves_energy[k], closures.layer[k], closures.distribution[k]
    return Closure(kind, weight, roughness, f0, f90, ior, *look, curve, edge, film, stretch)


@part
def facets_of(closure):
    """The facets of a rough closure, in a frame whose +x is their tangent."""
    alpha = closure.roughness * closure.roughness
    return Facets(closure.distribution, alpha * closure.stretch, alpha / closure.stretch)


@part
def _stretched(roughness, stretch):
    """The roughness that has the mean width √(α_x α_y) of stretched facets, none wider than 1; and √(α_x/α_y)."""
    alpha = roughness * roughness
    x, y = min(alpha * stretch, ONE), min(alpha / stretch, ONE)
    return np.sqrt(np.sqrt(x * y)), np.sqrt(x / max(y, _TINY)) if x > ZERO else ONE


@part
def radiance_scale(ior, from_light):
    """(η_light/η_view)² of refraction away from the side that `ior` is seen from; 1 for a path."""
    return ONE / (ior * ior) if from_light else ONE


@part
def is_nothing(color):
    """Whether a colour is black."""
    return color[0] == ZERO and color[1] == ZERO and color[2] == ZERO
