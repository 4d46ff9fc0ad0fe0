"""The closures of a point on a surface, as the scattering sees them, inside kernels.

The local frame has as +z the normal of the side that the light came to; wo is where it came from, so wo.z > 0.
Transmitted directions have wi.z < 0. Closures with normals of their own have frames within it, see `frames`.

Paths and photons follow the same f(view, light), the one from the view, the other from the light. All of f is
reciprocal but for sheen and toon, and for the factors that belong to the viewing side: what layers leave to what they
cover, the scale of multiple scattering, and how refraction changes radiance. A photon views from where it goes, so they
are taken there. Where a material differs by side or by kind of ray, its closures are those that the view sees, too.
"""

from typing import NamedTuple

import numpy as np

from ..core.compiling import part
from ..core.vec3 import BLACK, ONE, WHITE, ZERO, negative, row
from ..scene import RayKind
from ..scene.closures import N_ANGLES, Lobe
from ..scene.hit import channel_at, material_seen
from .microfacets import Facets

GLOSSY, GLASS = int(Lobe.GLOSSY), int(Lobe.GLASS)
TRANSMITTING_LOBES = 1 << int(Lobe.TRANSLUCENT) | 1 << GLASS | 1 << int(Lobe.PANE) | 1 << int(Lobe.FIBRE)
"""Lobes that send light through the surface, as bits."""
_LAST_ANGLE = np.float32(N_ANGLES - 1)
_DIFFUSE_RAY, _CAMERA_RAY = int(RayKind.DIFFUSE), int(RayKind.CAMERA)

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
def bsdf_at(scene, hit, kind):
    """The scattering where a ray met a surface, as rays of a `RayKind` see it."""
    return _bsdf(scene, hit.triangle, hit.u, hit.v, hit.back, hit.back, kind)


@part
def bsdf_of(scene, triangle, u, v, back):
    """The scattering at a point of a triangle, of light that comes to its back or else its front, for diffuse rays."""
    return _bsdf(scene, triangle, u, v, back, back, _DIFFUSE_RAY)


@part
def seen_by_camera(scene, triangle, u, v, back):
    """The same for a camera."""
    return _bsdf(scene, triangle, u, v, back, back, _CAMERA_RAY)


@part
def seen_otherwise(scene, triangle, back, kind):
    """Whether rays of a kind see other closures on a side of a triangle than diffuse rays do."""
    if not scene.materials.differs_by_kind[scene.material[triangle]]:
        return False
    return material_seen(scene, triangle, back, np.int64(kind)) != material_seen(scene, triangle, back, _DIFFUSE_RAY)


@part
def seen_from_behind(scene, bsdf, kind):
    """What the same point does to the same light as rays of a kind see it that come from the other side."""
    return _bsdf(scene, bsdf.triangle, bsdf.u, bsdf.v, bsdf.back, not bsdf.back, kind)


@part
def _bsdf(scene, triangle, u, v, back, seen_from_back, kind):
    """The scattering of light that comes to one side by the closures that are seen from a side."""
    material, start = material_seen(scene, triangle, seen_from_back, np.int64(kind)), scene.materials.closures.start
    normal = row(scene.normals, triangle)
    if back:
        normal = negative(normal)
    perturbed = scene.materials.perturbed[scene.material[triangle]]
    return Bsdf(start[material], start[material + 1], triangle, u, v, back, normal, perturbed)


@part
def has_lobes(scene, bsdf, lobes):
    """Whether a point has a closure of a set of lobes."""
    found = False
    for k in range(bsdf.first, bsdf.last):
        found |= bool(lobes >> scene.materials.closures.kind[k] & 1)
    return found


@part
def closure_at(scene, bsdf, k):
    """The k-th closure of the scene at a point that has it.

    To save look-ups a Lambertian one has its weight alone, and `edge` is white where the curve does not take it.
    """
    closures, at = scene.materials.closures, (bsdf.triangle, bsdf.u, bsdf.v)
    kind, ior, curve = closures.kind[k], closures.ior[k], closures.curve[k]
    weight, roughness, stretch = channel_at(scene, closures.weight, k, *at), ONE, ONE
    f0, f90, edge, film = BLACK, BLACK, WHITE, BLACK
    if kind >= GLOSSY:
        roughness, stretch = roughness_at(scene, bsdf, k)
        f0, f90 = channel_at(scene, closures.f0, k, *at), channel_at(scene, closures.f90, k, *at)
    if curve > 0:
        edge = channel_at(scene, closures.edge, k, *at)
    if closures.film.value[k, 0] > ZERO:
        film = channel_at(scene, closures.film, k, *at)
    if kind == GLASS and bsdf.back:
        ior = ONE / ior
        film = film[0], film[1] * ior, film[2]
    look = closures.fresnel[k], closures.preserves_energy[k], closures.layer[k], closures.distribution[k]
    return Closure(kind, weight, roughness, f0, f90, ior, *look, curve, edge, film, stretch)


@part
def roughness_at(scene, bsdf, k):
    """The roughness of the k-th closure, and what stretches its facets."""
    closures, at = scene.materials.closures, (bsdf.triangle, bsdf.u, bsdf.v)
    roughness = channel_at(scene, closures.roughness, k, *at)[0]
    if not closures.stretched[k]:
        return roughness, ONE
    return _stretched(roughness, channel_at(scene, closures.stretch, k, *at)[0])


@part
def angle_weight(scene, k, cos):
    """What the k-th closure's weight is multiplied by, seen at a cosine to the normal: its curve in `AngleCurves`."""
    curve = scene.materials.closures.by_angle[k]
    if curve < 0:
        return ONE
    at = np.sqrt(max(cos, ZERO)) * _LAST_ANGLE
    j = np.int64(min(at, _LAST_ANGLE - ONE))
    share, curves = at - np.float32(j), scene.materials.closures.angle_curves
    return curves[curve, j] * (ONE - share) + curves[curve, j + 1] * share


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
