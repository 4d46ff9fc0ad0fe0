"""Light that far emitters send towards the region where it is wanted: of a sky of triangles next to none finds a yard.

Half of the photons that such an emitter sends are aimed. Those of the sun go through nested discs, each twice as wide
as the one before; here the same is done with directions: about as many in each octave of the solid angle around the
region's centre, from the region's own on. So a photon that ends beside the region carries little more than one that
ends in it. The other half leave as they would anyway. Each direction is left to that half which finds it more often
(the maximum heuristic: Veach 1997, 9.2.4), so that guiding the one does not make the other's photons heavy.
"""

from typing import NamedTuple

import numpy as np

from ...core.compiling import part
from ...core.sampling.warps import versine_octaves
from ...core.vec3 import ONE, ZERO, dot, minus, to_world
from .projection_map import cone_to_ball

_SHARE = np.float32(0.5)  # of the photons
FAR = 2.0
"""Distance in radii of the region from which photons are aimed: from there a fifteenth of all directions meet it."""

_FAR2 = np.float32(FAR**2)


class Towards(NamedTuple):
    """A photon that may be aimed at the region.

    Attributes
    ----------
    far, goes : bool
        Whether photons from there are aimed, and whether this one is.
    u : float32
        What is left of its first number.
    versine, axis
        Of the cone to the region.
    """

    far: bool
    goes: bool
    u: np.float32
    versine: float
    axis: tuple


@part
def towards_region(centre, radius, u, origin):
    """Whether a photon of the first number `u` from an origin is aimed at a region."""
    versine, axis = cone_to_ball(centre, radius, origin, ZERO)
    away = minus(origin, centre)
    far = radius > ZERO and dot(away, away) > _FAR2 * radius * radius
    goes = far and u < _SHARE
    left = u if not far else (u / _SHARE if goes else (u - _SHARE) / (ONE - _SHARE))
    return Towards(far, goes, left, max(versine, 1e-12), axis)


@part
def aimed_direction(towards, v):
    """The direction of a photon that goes to the region."""
    return to_world(versine_octaves(np.float64(towards.u), v, towards.versine), towards.axis)


@part
def per_density_towards(towards, direction, unaimed):
    """1 over the density of a direction, sr; 0 of one that the other half of the photons brings.

    `unaimed` is the density by solid angle that the direction has without aim.
    """
    if not towards.far:
        return ONE / unaimed
    aside = minus(direction, towards.axis)
    # 1 − a·b = |a − b|²/2, with all its digits
    aimed = _pdf_octaves(0.5 * np.float64(dot(aside, aside)), towards.versine)
    own, other = (aimed, np.float64(unaimed)) if towards.goes else (np.float64(unaimed), aimed)
    share = np.float64(_SHARE if towards.goes else ONE - _SHARE)
    return np.float32(1.0 / (share * own)) if own >= other else ZERO


@part
def _pdf_octaves(versine, narrow):
    """Density of `versine_octaves` by solid angle: with v the versine and s narrow, 1/(2π (s+v) ln(1 + 2/s))."""
    return 1.0 / (2.0 * np.pi * (narrow + versine) * np.log1p(2.0 / narrow))
